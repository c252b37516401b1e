/// The three programs on a secured domain, started one by one, so that somebody can come between.
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
  /// A figure eight of so many seconds of simulation, 250 steps each.
  explicit SecuredRun(int seconds = 2);

  std::unique_ptr<Process> start_server() const;
  std::unique_ptr<Process> start_recorder() const;
  std::unique_ptr<Process> start_client(const std::vector<std::string>& flags = {},
                                        const std::string& identity = {}) const;

  /// Any program in this domain, in front of whose command line `before` is put.
  std::unique_ptr<Process> start(const std::string& name, const std::vector<std::string>& flags,
                                 const std::vector<std::string>& before,
                                 const std::string& qos_file = qos("secure")) const;

  /// Expects all three to end well, and the bytes of a flight without security.
  void expect_same_as_open(Process& server, Process& client, Process& recorder) const;

  std::filesystem::path recording() const { return folder_ / "recording"; }
  std::string scenario_file() const { return folder_ / "scenario.yaml"; }

  Keys keys;
  OwnDomain domain;

 private:
  TemporaryFolder folder_;
};

}  // namespace sls::test
