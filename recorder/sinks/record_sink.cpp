#include "recorder/sinks/record_sink.hpp"

#include "recorder/sinks/csv/csv_sink.hpp"
#include "recorder/sinks/mcap/mcap_sink.hpp"

namespace sls::record {

std::vector<std::unique_ptr<RecordSink>> make_sinks(const std::filesystem::path& folder,
                                                    const Parameters& parameters,
                                                    const config::Record& record,
                                                    const WriteCall& write) {
  std::vector<std::unique_ptr<RecordSink>> sinks;
  sinks.push_back(std::make_unique<CsvSink>(folder, parameters, write));
  if (record.has(config::RecordFormat::kMcap))
    sinks.push_back(std::make_unique<McapSink>(folder / McapSink::kFile, parameters, write));
  return sinks;
}

}  // namespace sls::record
