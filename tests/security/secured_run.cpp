#include "tests/security/secured_run.hpp"

#include <gtest/gtest.h>

namespace sls::test {

SecuredRun::SecuredRun() : Programs({qos("secure"), {}, {}}) {
  write_bytes(scenario_file(),
              replace_once(read_bytes(scenario("short")), "timeout_s: 30", "timeout_s: 120"));
}

std::unique_ptr<Process> SecuredRun::start_server() const {
  return start("sim_server", {"--scenario", scenario_file()}, keys.as());
}

std::unique_ptr<Process> SecuredRun::start_recorder() const {
  return start("recorder", {"--out", recording()}, keys.as());
}

std::unique_ptr<Process> SecuredRun::start_client(const Words& flags,
                                                  const std::string& identity) const {
  return start("control_client", Words{"--scenario", scenario_file()} + flags, keys.as(identity));
}

void SecuredRun::expect_same_as_open(Process& server, Process& client, Process& recorder) const {
  expect_success({&server, &client, &recorder});
  ASSERT_FALSE(testing::Test::HasFailure());
  EXPECT_TRUE(read_manifest(recording()).at("complete").get<bool>());
  expect_undisturbed(recording(), scenario_file());
}

}  // namespace sls::test
