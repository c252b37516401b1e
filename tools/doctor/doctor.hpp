/// Finds out why data does not flow: README.md.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tools/doctor/check.hpp"

namespace sls::doctor {

struct DoctorOptions {
  std::filesystem::path qos_file;
  int domain = 0;
  std::string identity =
      "recorder";    ///< role whose keys it uses on a secured domain: a recorder may read all
  std::string peer;  ///< name or address of the other machine; empty: this one
};

/// Sends datagrams and samples over each path that the QoS file uses, listens, and returns the
/// checks. Takes about 8 s at most; ends early if `is_stopped` returns true.
/// @throws config::ConfigError if the QoS file cannot be used.
std::vector<Check> examine(const DoctorOptions& options, const std::function<bool()>& is_stopped);

/// Answers other doctors for `limit`, or until `is_stopped` returns true.
void answer(const DoctorOptions& options, std::chrono::seconds limit,
            const std::function<bool()>& is_stopped);

}  // namespace sls::doctor
