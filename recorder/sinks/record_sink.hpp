/// A format that a recording is written in. To add one: a folder beside csv/ and a line in
/// make_sinks().
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "recorder/rows.hpp"

namespace sls::record {

struct RecordedFile {
  std::filesystem::path path;
  std::uint64_t rows = 0;
  bool has_rows = true;  ///< a CSV file: `rows` without its header
};

/// Made with the folder and the run's parameters; used by one thread.
/// Every member @throws std::system_error naming the file when the disk refuses.
class RecordSink {
 public:
  virtual ~RecordSink() = default;

  /// The rows of a step; of each vehicle in step order.
  virtual void add(const StepRows& rows) = 0;
  virtual void add(const SimStatus& status) = 0;

  /// True when so much is pending that it must be flushed.
  virtual bool is_full() const = 0;
  /// Hands what is pending to the operating system, such that a recorder killed amid it leaves
  /// files that can be read and resumed.
  virtual void flush() = 0;

  /// Libraries whose version decides on the bytes of the files, by name.
  virtual std::map<std::string, std::string> list_versions() const { return {}; }

  /// Flushes and ends the files, and lists them.
  virtual std::vector<RecordedFile> finish() = 0;
};

/// Creates the files of the scenario's formats in `folder`.
/// @throws config::ConfigError, before any file is there, if `parameters` do not allow it.
std::vector<std::unique_ptr<RecordSink>> make_sinks(const std::filesystem::path& folder,
                                                    const Parameters& parameters,
                                                    const config::Record& record);

}  // namespace sls::record
