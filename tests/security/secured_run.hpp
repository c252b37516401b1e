/// The three programs on a secured domain. They start separately: a test can start others between.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/security/keys.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {

/// `before` + `command`.
std::vector<std::string> put_before(std::vector<std::string> before,
                                    const std::vector<std::string>& command);

class SecuredRun {
 public:
  /// A figure eight of 500 steps. The server waits 120 s for the others.
  SecuredRun();

  std::unique_ptr<Process> start_server() const;
  std::unique_ptr<Process> start_recorder() const;
  std::unique_ptr<Process> start_client(const std::vector<std::string>& flags = {},
                                        const std::string& identity = {}) const;

  /// Starts any program in this domain. Its command line follows `before`.
  std::unique_ptr<Process> start(const std::string& name, const std::vector<std::string>& flags,
                                 const std::vector<std::string>& before,
                                 const std::string& qos_file = qos("secure")) const;

  /// Expects all three to succeed, with the same bytes as a flight without security.
  void expect_same_as_open(Process& server, Process& client, Process& recorder) const;

  std::filesystem::path recording() const { return folder_ / "recording"; }
  std::string scenario_file() const { return folder_ / "scenario.yaml"; }

  Keys keys;
  OwnDomain domain;

 private:
  TemporaryFolder folder_;
};

}  // namespace sls::test
