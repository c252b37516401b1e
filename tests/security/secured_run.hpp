/// The three programs on a secured domain. They start separately: a test can start others between.
#pragma once

#include <memory>
#include <string>

#include "tests/security/keys.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {

class SecuredRun : public Programs {
 public:
  /// A figure eight of 500 steps. The server waits 120 s for the others.
  SecuredRun();

  std::unique_ptr<Process> start_server() const;
  std::unique_ptr<Process> start_recorder() const;
  std::unique_ptr<Process> start_client(const Words& flags = {},
                                        const std::string& identity = {}) const;

  /// Expects all three to succeed, with the same bytes as a flight without security.
  void expect_same_as_open(Process& server, Process& client, Process& recorder) const;

  std::string scenario_file() const { return folder / "scenario.yaml"; }

  Keys keys;
};

}  // namespace sls::test
