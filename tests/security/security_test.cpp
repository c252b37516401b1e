/// Flights on a secured domain, and intruders.
#include <gtest/gtest.h>

#include "tests/security/secured_run.hpp"
#include "tests/support/waiting.hpp"
#include "tests/tools/view/live/page_client.hpp"

namespace sls::test {
namespace {

// --- participants with keys ----------------------------------------------------------------------

/// Sends a request of an operator.
void operate(const SecuredRun& run, const std::vector<std::string>& words) {
  expect_success({run.start("sim_ctl", words, run.keys.as()).get()});
}

TEST(SecureFlightTest, AStandbyTakesOverAndTheKilledClientIsLetInAgain) {
  const SecuredRun run;
  run.keys.add("controller", "standby");
  const auto recorder = run.start_recorder(), server = run.start_server();
  operate(run, {"pause"});  // the flight begins paused
  const std::vector<std::string> as_primary = {"--name", "primary", "--strength", "2"};
  auto primary = run.start_client(as_primary);
  operate(run, {"step", "100"});
  const auto standby = run.start_client({"--name", "standby", "--strength", "1"}, "standby");
  ASSERT_TRUE(wait_for_text(*standby, "joins run")) << standby->output();
  primary->kill();
  operate(run, {"step", "100"});
  EXPECT_TRUE(holds(server->output(), "'standby' takes over from 'primary'")) << server->output();
  standby->send(SIGSTOP);  // holds the flight until the primary flies again
  primary = run.start_client(as_primary);
  ASSERT_TRUE(wait_for_text(*primary, "joins run")) << primary->output();
  operate(run, {"resume"});
  EXPECT_TRUE(wait_for_text(*server, "'primary' takes over from 'standby'")) << server->output();
  standby->send(SIGCONT);
  run.expect_same_as_open(*server, *primary, *recorder);
  EXPECT_EQ(standby->wait(), 0) << standby->output();
}

TEST(SecureFlightTest, AnOperatorMayPauseAndResumeAndAControllerOrViewerMayNot) {
  const SecuredRun run;
  const auto start_viewer = [&](const std::vector<std::string>& flags) {
    return run.start("sls_view", std::vector<std::string>{"--port", "0"} + flags, run.keys.as());
  };
  const auto viewer = start_viewer({}), operating = start_viewer({"--identity", "operator"});
  PageClient page(wait_for_port(*viewer)), operators(wait_for_port(*operating));
  const auto recorder = run.start_recorder(), server = run.start_server();
  operate(run, {"pause"});  // the flight begins paused
  const auto client = run.start_client();
  ASSERT_TRUE(page.wait_for_status("phase", "paused")) << viewer->output() << server->output();
  EXPECT_EQ(page.last("hello").at("may_operate"), false);
  const auto reply = page.control("stop");
  EXPECT_EQ(reply.at("accepted"), false);
  EXPECT_TRUE(holds(reply.at("reason"), "--identity operator")) << reply;
  const auto controller = run.start("sim_ctl", {"resume"}, run.keys.as("controller"));
  EXPECT_EQ(controller->wait(), 2);
  EXPECT_TRUE(holds(controller->output(), "identity 'controller': expected permission to"))
      << controller->output();
  EXPECT_TRUE(server->is_running());

  ASSERT_TRUE(operators.wait_for_status("phase", "paused")) << operating->output();
  EXPECT_EQ(operators.last("hello").at("may_operate"), true);
  EXPECT_EQ(operators.control("resume").at("accepted"), true) << operators.last("reply");
  EXPECT_TRUE(page.wait_for_step(100)) << viewer->output() << server->output();
  run.expect_same_as_open(*server, *client, *recorder);
}

// --- intruders -----------------------------------------------------------------------------------

/// Clients stronger than the server's own, and a recorder. The server must refuse and name them,
/// and the flight is the same as without them. They receive nothing.
TEST(IntruderTest, EachIsNamedWithItsCauseAndDisturbsNothing) {
  const SecuredRun run;
  const TemporaryFolder folder;
  // The run's scenario with a short time limit, after which a client that receives nothing ends.
  const auto make_flags = [&](const std::string& limit_s) {
    const std::string file = folder / ("intruder-" + limit_s + ".yaml");
    write_bytes(file, replace_once(read_bytes(run.scenario_file()), "timeout_s: 120",
                                   "timeout_s: " + limit_s));
    return std::vector<std::string>{"--scenario", file, "--strength", "1000"};
  };
  auto flags = make_flags("2");
  const auto server = run.start_server();
  ASSERT_TRUE(wait_for_text(*server, "waiting for"));
  std::vector<std::unique_ptr<Process>> intruders;
  const auto intrude = [&](const std::string& cause, const std::vector<std::string>& before,
                           const std::string& qos_file = {}) {
    intruders.push_back(run.start("control_client", flags, before, qos_file));
    EXPECT_TRUE(wait_until([&] {
      return holds(server->output(), "refused 'control_client'") && holds(server->output(), cause);
    })) << cause
        << "\n"
        << server->output() << intruders.back()->output();
  };
  const auto expect_nothing_received = [](Process& intruder) {
    EXPECT_EQ(intruder.wait(), 1) << intruder.output();
    EXPECT_TRUE(holds(intruder.output(), "no server for vehicle 0 within ")) << intruder.output();
    EXPECT_FALSE(holds(intruder.output(), "joins run")) << intruder.output();
  };

  // One after another: the middleware logs the causes without the names.
  const Keys others;
  intrude("its certificate is not accepted (unable to get local issuer certificate)", others.as());
  expect_nothing_received(*intruders.back());
  run.keys.add_expired("controller", "old");
  auto before = run.keys.as("old");
  before.insert(before.end(),  // a clock that is behind
                {std::string("LD_PRELOAD=") + SLS_CLOCK_SHIM, "SLS_CLOCK_SHIFT_S=-64800"});
  intrude("its certificate is not accepted (certificate has expired)", before);
  expect_nothing_received(*intruders.back());
  const auto commanding = run.start("control_client", flags, run.keys.as("recorder"));
  EXPECT_EQ(commanding->wait(), 2);
  EXPECT_TRUE(holds(commanding->output(), "identity 'recorder': expected permission to write sls/"))
      << commanding->output();

  // These are there during the flight.
  flags = make_flags("4");
  run.keys.add_usurper("usurper");
  // Fast DDS 2.11 already refuses to start with such permissions.
  constexpr const char* kRefusal = "Participant is not allowed with its own permissions file";
  const auto usurper = run.start("control_client", flags, run.keys.as("usurper"));
  EXPECT_TRUE(wait_until([&] {
    return holds(server->output(), "its permissions are not signed by our permissions authority") ||
           holds(usurper->output(), kRefusal);
  })) << server->output()
      << usurper->output();
  intrude("it has no identity", {}, qos("lan"));
  const std::string stolen = folder / "stolen";
  const auto stealing = run.start("recorder", {"--out", stolen}, {}, qos("lan"));
  ASSERT_TRUE(wait_for_text(*server, "refused 'recorder'")) << server->output();
  const auto recorder = run.start_recorder(), client = run.start_client();
  run.expect_same_as_open(*server, *client, *recorder);
  if (!holds(usurper->output(), kRefusal)) expect_nothing_received(*usurper);
  expect_nothing_received(*intruders[2]);
  stealing->send(SIGTERM);
  EXPECT_EQ(stealing->wait(), 143) << stealing->output();
  EXPECT_FALSE(std::filesystem::exists(stolen + "/state.csv"));
}

}  // namespace
}  // namespace sls::test
