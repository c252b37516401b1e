#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "recorder/sinks/csv/csv_file.hpp"
#include "recorder/sinks/record_sink.hpp"

namespace sls::record {

/// The CSV files of README.md.
class CsvSink : public RecordSink {
 public:
  CsvSink(const std::filesystem::path& folder, const Parameters& parameters,
          const WriteCall& write = system_write());

  void add(const StepRows& rows) override;
  void add(const SimStatus& status) override;
  bool is_full() const override;
  void flush() override;
  std::vector<RecordedFile> finish() override;

 private:
  const std::filesystem::path folder_;
  const WriteCall write_;
  const std::string state_header_;
  const bool is_of_fleet_;
  CsvFile states_, references_, flight_, statuses_, commands_;
  /// Flushed in this order, commands last: if a recorder is killed, each step with a command row
  /// also has its other rows.
  const std::array<CsvFile*, 5> files_{&states_, &references_, &flight_, &statuses_, &commands_};
  std::optional<CsvFile> measured_;  // created with its first row
};

}  // namespace sls::record
