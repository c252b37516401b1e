#include "recorder/recording_folder.hpp"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>
#include <string_view>
#include <system_error>

#include "common/config/config_error.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;
using config::ConfigError;

constexpr std::array<std::string_view, 9> kRecordingFiles = {
    "state.csv",  "command.csv",   "reference.csv", "status.csv",        "flight.csv",
    "flight.txt", "scenario.yaml", "manifest.json", "manifest.json.part"};

bool is_recording_file(const fs::directory_entry& entry) {
  std::error_code error;
  if (fs::is_directory(entry.symlink_status(error))) return false;
  for (const auto name : kRecordingFiles)
    if (entry.path().filename() == name) return true;
  return false;
}

}  // namespace

void prepare_recording_folder(const fs::path& folder, bool force) {
  const std::string place = "--out " + folder.string();
  std::error_code error;
  fs::create_directories(folder, error);
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored))
    throw ConfigError(place + ": expected a folder, or a place for a new one, got: " +
                      (fs::exists(folder, ignored) ? "a file" : error.message()));
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    throw ConfigError(place + ": expected a folder that can be written, got: " +
                      std::generic_category().message(errno));

  fs::directory_iterator entries(folder, error);
  if (error) throw ConfigError(place + ": expected a readable folder, got: " + error.message());
  for (const auto& entry : entries) {
    if (!force)
      throw ConfigError(place + ": expected an empty folder, got one with '" +
                        entry.path().filename().string() +
                        "' in it (--force replaces a recording)");
    if (!is_recording_file(entry))
      throw ConfigError(place + ": expected nothing but an earlier recording, got '" +
                        entry.path().filename().string() + "', which --force does not remove");
  }
  for (const auto name : kRecordingFiles) {
    fs::remove(folder / name, error);
    if (error)
      throw ConfigError(place + ": expected to replace '" + std::string(name) +
                        "', got: " + error.message());
  }
}

}  // namespace sls::record
