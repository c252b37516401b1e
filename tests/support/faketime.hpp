/// A wrong wall clock for a program, set with Debian's libfaketime. Its monotonic clock stays
/// right, as on a real host.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

namespace sls::test {

/// The library for programs with several threads; empty if it is not installed.
inline std::string find_faketime() {
  namespace fs = std::filesystem;
  for (const auto& folder : fs::directory_iterator("/usr/lib")) {
    std::error_code none;
    const fs::path library = folder.path() / "faketime/libfaketimeMT.so.1";
    if (fs::exists(library, none)) return library;
  }
  return "";
}

inline constexpr const char* kNoFaketime = "no libfaketime (Debian package libfaketime)";

/// Words for `env` that shift the wall clock: `setting` is FAKETIME=OFFSET, or
/// FAKETIME_TIMESTAMP_FILE=FILE, which is read at each look at the clock.
inline std::vector<std::string> make_clock_words(const std::string& setting) {
  return {"LD_PRELOAD=" + find_faketime(), setting, "FAKETIME_NO_CACHE=1",
          "FAKETIME_DONT_FAKE_MONOTONIC=1"};
}

/// Removes the files in shared memory that ended processes with a wrong clock have left:
/// libfaketime removes them in a static destructor (common/bus/end_process.hpp).
inline void remove_faketime_files() {
  namespace fs = std::filesystem;
  std::error_code none;
  for (const auto& file : fs::directory_iterator("/dev/shm", none)) {
    const std::string name = file.path().filename().string();
    const bool is_of_faketime =
        name.rfind("faketime_shm_", 0) == 0 || name.rfind("sem.faketime_sem_", 0) == 0;
    const std::string process = name.substr(name.rfind('_') + 1);
    if (is_of_faketime && !fs::exists("/proc/" + process, none)) fs::remove(file.path(), none);
  }
}

}  // namespace sls::test
