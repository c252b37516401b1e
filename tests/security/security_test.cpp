/// Flights on a secured domain, and intruders.
#include <gtest/gtest.h>

#include "tests/security/secured_run.hpp"
#include "tests/support/waiting.hpp"
#include "tests/tools/view/live/page_client.hpp"

namespace sls::test {
namespace {

bool wait_for_text(const Process& process, const std::string& text) {
  return wait_until([&] { return process.output().find(text) != std::string::npos; });
}

bool wait_for_rows(const std::filesystem::path& recording, std::size_t rows) {
  return wait_until([&] {
    const std::string text = read_file(recording / "state.csv");
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) > rows;
  });
}

// --- participants with keys ----------------------------------------------------------------------

TEST(SecureFlightTest, RecordsTheBytesOfAnOpenOne) {
  const SecuredRun run;
  const auto recorder = run.start_recorder(), server = run.start_server(),
             client = run.start_client();
  run.expect_same_as_open(*server, *client, *recorder);
}

TEST(SecureFlightTest, AStandbyTakesOverAndTheKilledClientIsLetInAgain) {
  const SecuredRun run(64);
  run.keys.add("controller", "standby");
  const auto recorder = run.start_recorder(), server = run.start_server();
  const auto standby = run.start_client({"--name", "standby", "--strength", "1"}, "standby");
  auto primary = run.start_client({"--name", "primary", "--strength", "2"});
  ASSERT_TRUE(wait_for_rows(run.recording(), 500)) << server->output();
  primary->kill();
  ASSERT_TRUE(wait_for_rows(run.recording(), 1000)) << server->output();
  standby->send(SIGSTOP);  // holds the flight until the primary has joined again
  primary = run.start_client({"--name", "primary", "--strength", "2"});
  ASSERT_TRUE(wait_for_text(*primary, "joins run")) << primary->output();
  standby->send(SIGCONT);
  run.expect_same_as_open(*server, *primary, *recorder);
  EXPECT_EQ(standby->wait(), 0) << standby->output();

  const Table commands(run.recording() / "command.csv");
  std::string controllers;  // in the order of their answers
  for (std::size_t row = 0; row < commands.rows(); ++row)
    if (row == 0 || commands.text(row, "controller") != commands.text(row - 1, "controller"))
      controllers += commands.text(row, "controller") + " ";
  EXPECT_NE(controllers.find("primary standby primary"), std::string::npos) << controllers;
}

TEST(SecureFlightTest, AnOperatorMayPauseAndResumeAndAControllerMayNot) {
  const SecuredRun run(64);
  const auto recorder = run.start_recorder(), server = run.start_server(),
             client = run.start_client();
  ASSERT_TRUE(wait_for_rows(run.recording(), 100)) << server->output();
  client->send(SIGSTOP);  // holds the flight until sim_ctl has joined
  const auto pause = run.start("sim_ctl", {"pause"}, run.keys.as());
  ASSERT_EQ(pause->wait(), 0) << pause->output();
  client->send(SIGCONT);
  const auto controller = run.start("sim_ctl", {"resume"}, run.keys.as("controller"));
  EXPECT_EQ(controller->wait(), 2);
  EXPECT_NE(controller->output().find("identity 'controller': expected permission to"),
            std::string::npos)
      << controller->output();
  EXPECT_TRUE(server->is_running());
  const auto resume = run.start("sim_ctl", {"resume"}, run.keys.as());
  ASSERT_EQ(resume->wait(), 0) << resume->output();
  run.expect_same_as_open(*server, *client, *recorder);
}

TEST(SecureFlightTest, AViewerSeesTheFlightAndMayNotOperateIt) {
  const SecuredRun run(64);
  const auto viewer = run.start("sls_view", {"--port", "0"}, run.keys.as());
  PageClient page(wait_for_port(*viewer));
  const auto recorder = run.start_recorder(), server = run.start_server(),
             client = run.start_client();
  ASSERT_TRUE(page.wait_for_step(100)) << viewer->output() << server->output();
  EXPECT_EQ(page.last("hello").at("may_operate"), false);
  const auto reply = page.control("stop");
  EXPECT_EQ(reply.at("accepted"), false);
  EXPECT_NE(reply.at("reason").get<std::string>().find("--identity operator"), std::string::npos);
  run.expect_same_as_open(*server, *client, *recorder);
}

TEST(SecureFlightTest, AViewerWithAnOperatorsKeysOperates) {
  const SecuredRun run(64);
  const auto viewer =
      run.start("sls_view", {"--port", "0", "--identity", "operator"}, run.keys.as());
  PageClient page(wait_for_port(*viewer));
  const auto recorder = run.start_recorder(), server = run.start_server(),
             client = run.start_client();
  ASSERT_TRUE(page.wait_for_step(100)) << viewer->output() << server->output();
  EXPECT_EQ(page.last("hello").at("may_operate"), true);
  EXPECT_EQ(page.control("pause").at("accepted"), true) << page.last("reply");
  EXPECT_TRUE(page.wait_for_status("phase", "paused"));
  EXPECT_EQ(page.control("resume").at("accepted"), true) << page.last("reply");
  run.expect_same_as_open(*server, *client, *recorder);
}

// --- intruders -----------------------------------------------------------------------------------

/// A server, and an intruder: a client stronger than its own, which it must refuse.
class IntruderTest : public testing::Test {
 protected:
  void SetUp() override {
    // The run's scenario with a short time limit: an intruder that receives nothing ends after 4 s.
    write_bytes(folder_ / "intruder.yaml",
                replace_once(read_bytes(run_.scenario_file()), "timeout_s: 30", "timeout_s: 4"));
  }

  std::vector<std::string> flags() const {
    return {"--scenario", (folder_ / "intruder.yaml").string(), "--strength", "1000"};
  }

  /// Expects that the server names the intruder with `cause`, that the flight is the same as
  /// without it, and that the intruder received nothing.
  void expect_harmless(const std::string& cause, const std::vector<std::string>& before,
                       const std::string& qos_file = qos("secure")) {
    const auto server = run_.start_server();
    ASSERT_TRUE(wait_for_text(*server, "waiting for"));
    const auto intruder = run_.start("control_client", flags(), before, qos_file);
    ASSERT_TRUE(wait_for_text(*server, "refused 'control_client'"))
        << server->output() << intruder->output();
    const auto recorder = run_.start_recorder(), client = run_.start_client();
    run_.expect_same_as_open(*server, *client, *recorder);
    EXPECT_NE(server->output().find(cause), std::string::npos) << server->output();

    EXPECT_EQ(intruder->wait(), 1) << intruder->output();
    EXPECT_NE(intruder->output().find("no server for vehicle 0 within 4 s"), std::string::npos)
        << intruder->output();
    EXPECT_EQ(intruder->output().find("joins run"), std::string::npos) << intruder->output();
  }

  SecuredRun run_;
  TemporaryFolder folder_;
};

TEST_F(IntruderTest, WithoutAnIdentity) { expect_harmless("it has no identity", {}, qos("lan")); }

TEST_F(IntruderTest, OfAnotherAuthority) {
  const Keys others;
  expect_harmless("its certificate is not accepted (unable to get local issuer certificate)",
                  others.as());
}

TEST_F(IntruderTest, WithAnExpiredCertificateAndAClockThatIsBehind) {
  run_.keys.add_expired("controller", "old");
  auto before = run_.keys.as("old");
  before.insert(before.end(),
                {std::string("LD_PRELOAD=") + SLS_CLOCK_SHIM, "SLS_CLOCK_SHIFT_S=-64800"});
  expect_harmless("its certificate is not accepted (certificate has expired)", before);
}

TEST_F(IntruderTest, ARecorderThatSignsItsOwnPermissions) {
  run_.keys.add_usurper("usurper");
  expect_harmless("its permissions are not signed by our permissions authority",
                  run_.keys.as("usurper"));
}

TEST_F(IntruderTest, ARecorderThatCommandsEndsAtOnce) {
  const auto server = run_.start_server();
  ASSERT_TRUE(wait_for_text(*server, "waiting for"));
  const auto intruder = run_.start("control_client", flags(), run_.keys.as("recorder"));
  EXPECT_EQ(intruder->wait(), 2);
  EXPECT_NE(intruder->output().find("identity 'recorder': expected permission to write sls/"),
            std::string::npos)
      << intruder->output();
  const auto recorder = run_.start_recorder(), client = run_.start_client();
  run_.expect_same_as_open(*server, *client, *recorder);
}

TEST_F(IntruderTest, ARecorderWithoutAnIdentityRecordsNothing) {
  const auto intruder =
      run_.start("recorder", {"--out", (folder_ / "stolen").string()}, {}, qos("lan"));
  const auto server = run_.start_server();
  ASSERT_TRUE(wait_for_text(*server, "refused 'recorder'")) << server->output();
  const auto recorder = run_.start_recorder(), client = run_.start_client();
  run_.expect_same_as_open(*server, *client, *recorder);
  intruder->send(SIGTERM);
  EXPECT_EQ(intruder->wait(), 143) << intruder->output();
  EXPECT_FALSE(std::filesystem::exists(folder_ / "stolen/state.csv"));
}

}  // namespace
}  // namespace sls::test
