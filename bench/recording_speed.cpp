#include "bench/recording_speed.hpp"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "bench/flown_run.hpp"
#include "common/app/run_main.hpp"
#include "common/bus/convert.hpp"
#include "common/text/sha256.hpp"
#include "recorder/columns.hpp"
#include "recorder/recording.hpp"
#include "recorder/rows.hpp"
#include "recorder/sinks/mcap/mcap_sink.hpp"

namespace sls::bench {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kRecordedRun = 1;
constexpr std::array<const char*, 4> kFiles = {"state.csv", "command.csv", "reference.csv",
                                               "flight.csv"};

double calc_seconds(Clock::time_point from) {
  return std::chrono::duration<double>(Clock::now() - from).count();
}

/// A new folder, removed at the end.
class ScratchFolder {
 public:
  explicit ScratchFolder(const fs::path& parent)
      : path_(parent / fmt::format("sls-bench-{}", Clock::now().time_since_epoch().count())) {
    fs::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  const fs::path path_;
};

/// A CSV file with the buffer of the C library.
class PlainFile {
 public:
  PlainFile(const fs::path& path, std::string_view header) {
    file_.reset(std::fopen(path.c_str(), "wb"));
    if (!file_) throw app::RunError(path.string() + ": cannot write");
    std::setvbuf(file_.get(), nullptr, _IOFBF, 1 << 18);
    std::fwrite(header.data(), 1, header.size(), file_.get());
    std::fputc('\n', file_.get());
  }
  /// Visits the fields of a row.
  template <class Field>
  void operator()(const record::Column&, const Field& field) {
    record::for_each_component(field, [this](const auto& component) { this->add(component); });
  }
  template <class Number>
  void add(const Number& number) {
    end_ = std::to_chars(end_, row_.data() + row_.size(), number).ptr;
    *end_++ = ',';
  }
  void add(const std::string& text) {
    end_ = std::copy(text.begin(), text.end(), end_);
    *end_++ = ',';
  }
  template <class Row, class Rows>
  void write(const Rows& rows) {
    Row::visit(rows, *this);
    end_[-1] = '\n';
    std::fwrite(row_.data(), 1, static_cast<std::size_t>(end_ - row_.data()), file_.get());
    end_ = row_.data();
  }
  void close() { file_.reset(); }

 private:
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{nullptr, &std::fclose};
  std::array<char, 1024> row_;
  char* end_ = row_.data();
};

double write_plain_files(const std::vector<model::StepRecord>& records,
                         const Parameters& parameters, const fs::path& folder) {
  const auto vehicles = static_cast<std::uint32_t>(parameters.vehicles().size());
  std::vector<record::StepRows> steps(records.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    static_cast<model::StepRecord&>(steps[i]) = records[i];
    record::fill_columns(steps[i], record::make_row_format(parameters));
  }
  const auto began = Clock::now();
  PlainFile states(folder / kFiles[0], record::make_header<record::StateRow>());
  PlainFile commands(folder / kFiles[1], record::make_header<record::CommandRow>());
  PlainFile references(folder / kFiles[2], record::make_header<record::ReferenceRow>());
  PlainFile flight(folder / kFiles[3], record::make_flight_header(vehicles > 1));
  for (record::StepRows& rows : steps) {
    for (rows.vehicle_id = 0; rows.vehicle_id < vehicles; ++rows.vehicle_id) {
      states.write<record::StateRow>(rows);
      references.write<record::ReferenceRow>(rows);
      flight.write<record::FlightRow>(record::FlightRow{rows, vehicles > 1});
      commands.write<record::CommandRow>(rows);
    }
  }
  for (PlainFile* file : {&states, &commands, &references, &flight}) file->close();
  return calc_seconds(began);
}

/// The samples that a server would publish.
std::vector<RecordBatch> make_batches(const std::vector<model::StepRecord>& records,
                                      std::uint32_t vehicles) {
  constexpr std::size_t kEntries = 20;  // 12 KB
  std::vector<RecordBatch> batches(1);
  for (const model::StepRecord& record : records)
    for (std::uint32_t id = 0; id < vehicles; ++id) {
      if (batches.back().entries().size() == kEntries) batches.emplace_back();
      bus::fill(batches.back().entries().emplace_back(), record);
      batches.back().entries().back().vehicle_id(id);
    }
  for (std::size_t i = 0; i < batches.size(); ++i) {
    batches[i].run_id(kRecordedRun);
    batches[i].batch_index(i);
  }
  batches.back().is_last(true);
  return batches;
}

}  // namespace

nlohmann::json measure_recording(const config::Scenario& scenario, std::uint32_t vehicles,
                                 std::size_t steps, const fs::path& folder) {
  const std::vector<model::StepRecord> records = fly_records(scenario, steps);
  const Parameters parameters = make_parameters(scenario, kRecordedRun, vehicles);
  const ScratchFolder ours(folder), plain(folder);
  nlohmann::json json;
  json["rows"] = kFiles.size() * records.size() * vehicles;
  {
    const auto batches = make_batches(records, vehicles);
    record::Recording recording(ours.path(), parameters);
    recording.add(make_status(kRecordedRun, 0, RunPhase::PHASE_RUNNING, 0));
    auto began = Clock::now();
    for (const RecordBatch& batch : batches) {
      recording.add(batch);
      recording.flush_if_due();
    }
    recording.add(make_status(kRecordedRun, 1, RunPhase::PHASE_FINISHED, records.size() - 1));
    json["recording_s"] = calc_seconds(began);
    began = Clock::now();
    if (!recording.finish("", 0)) throw app::RunError("recording: " + recording.describe_gaps());
    json["finish_s"] = calc_seconds(began);
  }
  json["plain_s"] = write_plain_files(records, parameters, plain.path());
  std::uintmax_t bytes = 0;
  for (const char* file : kFiles) {
    bytes += fs::file_size(ours.path() / file);
    if (text::calc_file_sha256(ours.path() / file) != text::calc_file_sha256(plain.path() / file))
      throw app::RunError(std::string(file) + ": the plain file differs from the recording's");
  }
  json["bytes"] = bytes;
  if (scenario.record.has(config::RecordFormat::kMcap))
    json["mcap_bytes"] = fs::file_size(ours.path() / record::McapSink::kFile);
  return json;
}

}  // namespace sls::bench
