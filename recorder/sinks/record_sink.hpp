/// A file format of recordings. To add one, add a folder beside csv/ and a line in make_sinks().
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "recorder/rows.hpp"
#include "recorder/sinks/growing_file.hpp"

namespace sls::record {

struct RecordedFile {
  std::filesystem::path path;
  std::uint64_t rows = 0;
  bool has_rows = true;  ///< a CSV file: `rows` without its header
};

/// Made with the folder and the run's parameters; used by one thread.
/// Every member @throws std::system_error with the name of the file if it cannot be written.
class RecordSink {
 public:
  virtual ~RecordSink() = default;

  /// Adds the rows of a step. The steps of each vehicle come in order.
  virtual void add(const StepRows& rows) = 0;
  virtual void add(const SimStatus& status) = 0;

  /// True when a flush is necessary because of the amount of pending data.
  virtual bool is_full() const = 0;
  /// Passes pending data to the operating system. If the recorder is killed during a flush, the
  /// files can still be read and resumed.
  virtual void flush() = 0;

  /// Versions of libraries that affect the bytes of the files, by name.
  virtual std::map<std::string, std::string> list_versions() const { return {}; }

  /// Flushes and ends the files, and lists them.
  virtual std::vector<RecordedFile> finish() = 0;
};

/// Creates the files of the scenario's formats in `folder`, which are written by `write`.
/// @throws config::ConfigError, before any file is created, if `parameters` do not allow it.
std::vector<std::unique_ptr<RecordSink>> make_sinks(const std::filesystem::path& folder,
                                                    const Parameters& parameters,
                                                    const config::Record& record,
                                                    const WriteCall& write);

}  // namespace sls::record
