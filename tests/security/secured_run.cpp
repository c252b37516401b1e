#include "tests/security/secured_run.hpp"

#include <gtest/gtest.h>

namespace sls::test {

std::vector<std::string> put_before(std::vector<std::string> before,
                                    const std::vector<std::string>& command) {
  before.insert(before.end(), command.begin(), command.end());
  return before;
}

SecuredRun::SecuredRun() {
  write_bytes(scenario_file(),
              replace_once(read_bytes(scenario("short")), "timeout_s: 30", "timeout_s: 120"));
}

std::unique_ptr<Process> SecuredRun::start(const std::string& name,
                                           const std::vector<std::string>& flags,
                                           const std::vector<std::string>& before,
                                           const std::string& qos_file) const {
  return std::make_unique<Process>(
      put_before(before, make_command(name, domain.number(), flags, qos_file)));
}

std::unique_ptr<Process> SecuredRun::start_server() const {
  return start("sim_server", {"--scenario", scenario_file()}, keys.as());
}

std::unique_ptr<Process> SecuredRun::start_recorder() const {
  return start("recorder", {"--out", recording().string()}, keys.as());
}

std::unique_ptr<Process> SecuredRun::start_client(const std::vector<std::string>& flags,
                                                  const std::string& identity) const {
  return start("control_client", put_before({"--scenario", scenario_file()}, flags),
               keys.as(identity));
}

void SecuredRun::expect_same_as_open(Process& server, Process& client, Process& recorder) const {
  EXPECT_EQ(server.wait(), 0) << server.output();
  EXPECT_EQ(client.wait(), 0) << client.output();
  EXPECT_EQ(recorder.wait(), 0) << recorder.output();
  ASSERT_FALSE(testing::Test::HasFailure());
  EXPECT_TRUE(read_manifest(recording()).at("complete").get<bool>());
  expect_undisturbed(recording(), scenario_file());
}

}  // namespace sls::test
