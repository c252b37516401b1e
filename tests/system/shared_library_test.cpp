/// Shared libraries that end or block the program that calls them.
#include <gtest/gtest.h>
#include <signal.h>

#include <regex>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

const std::string kController = std::string(SLS_LIBRARIES) + "/controller.so";
const std::string kPlant = std::string(SLS_LIBRARIES) + "/plant.so";
const std::string kAutopilot = std::string(SLS_LIBRARIES) + "/autopilot.so";

/// The short flight with the test controller, the test plant or the test autopilot.
std::string make_controller_scenario(const TemporaryFolder& folder, const std::string& parameters) {
  return make_scenario(
      folder,
      {{"  gains: { lqr: { horizontal: 10, vertical: 5 } }\n",
        "  law: " + kController + "\n  parameters: { " + parameters + " }\n"},
       {"timeout_s: 30 } }", "timeout_s: 30 }, wait: { controller: { deadline_s: 4 } } }"}});
}
std::string make_plant_scenario(const TemporaryFolder& folder, const std::string& parameters) {
  return make_scenario(
      folder,
      {{"  pendulum: ideal\n", "  model: " + kPlant + "\n  parameters: { " + parameters + " }\n"}});
}

std::string make_autopilot_scenario(const TemporaryFolder& folder, const std::string& parameters) {
  return make_scenario(
      folder,
      {{"  pendulum: ideal\n",
        "  model: multirotor\n"
        "  inertia_kg_m2: [0.03, 0.03, 0.06]\n"
        "  rotor: { thrust_constant_n_s2: 5.0e-6, max_speed_rad_s: 2000 }\n"
        "  rotors: [{ position_m: [1, 1, 0], spin: ccw }, { position_m: [-1, -1, 0], spin: ccw },\n"
        "           { position_m: [1, -1, 0], spin: cw }, { position_m: [-1, 1, 0], spin: cw }]\n"},
       {"sync:",
        "autopilot:\n  model: " + kAutopilot + "\n  parameters: { " + parameters + " }\nsync:"}});
}

class CrashTest : public testing::TestWithParam<std::pair<const char*, int>> {
 protected:
  const std::string how_ = GetParam().first;
  const int signal_ = GetParam().second;
  const std::string crashed_ = ": crashed (signal " + std::to_string(signal_) + ")\n";
  TemporaryFolder folder_;
};

TEST_P(CrashTest, IsNamedWithLibraryFunctionVehicleAndStep) {
  const auto fly = [&](const std::string& file) {
    return run({program("closed_loop"), "--scenario", file});
  };
  Outcome outcome = fly(make_controller_scenario(folder_, "in: answer, at: 5, do: " + how_));
  EXPECT_EQ(outcome.code, 128 + signal_);
  EXPECT_EQ(outcome.output,
            "closed_loop: error: " + kController + ": answer, vehicle 0, step 5" + crashed_);

  outcome = fly(make_plant_scenario(folder_, "in: advance, at: 8, do: " + how_));
  EXPECT_EQ(outcome.code, 128 + signal_);
  EXPECT_EQ(outcome.output,
            "closed_loop: error: " + kPlant + ": advance, vehicle 0, step 8" + crashed_);
}

TEST_P(CrashTest, InOneProcessKeepsTheRowsBeforeIt) {
  const Outcome outcome =
      run({program("closed_loop"), "--out", folder_ / "recording", "--scenario",
           make_controller_scenario(folder_, "in: answer, at: 300, do: " + how_)});
  EXPECT_EQ(outcome.code, 128 + signal_);
  const std::string line = kController + ": answer, vehicle 0, step 300" + crashed_;
  EXPECT_TRUE(holds(outcome.output, "closed_loop: error: " + line)) << outcome.output;
  const auto manifest = read_manifest(folder_ / "recording");
  EXPECT_EQ(manifest.at("reason").get<std::string>() + "\n", line);
  EXPECT_FALSE(manifest.at("complete").get<bool>());
  EXPECT_EQ(Table(folder_ / "recording/state.csv").rows(), 300u) << "steps 0 to 299";
}

TEST(SharedLibraryProgramTest, AnExitInsideALibraryIsNamedAndFails) {
  TemporaryFolder folder;
  const std::string file = make_controller_scenario(folder, "in: answer, at: 300, do: exit");
  const std::string line =
      kController + ": answer, vehicle 0, step 300: ended the program or its thread";
  const Outcome outcome =
      run({program("closed_loop"), "--out", folder / "recording", "--scenario", file});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_TRUE(holds(outcome.output, "closed_loop: error: " + line + "\n")) << outcome.output;
  EXPECT_EQ(read_manifest(folder / "recording").at("reason"), line);
  EXPECT_EQ(Table(folder / "recording/state.csv").rows(), 300u);

  Flight flight(file);
  EXPECT_EQ(flight.client->wait(), 1) << flight.outputs();
  EXPECT_TRUE(holds(flight.client->output(), "control_client: error: " + line + "\n"));
}

INSTANTIATE_TEST_SUITE_P(Signals, CrashTest,
                         testing::Values(std::pair("crash", SIGSEGV), std::pair("abort", SIGABRT),
                                         std::pair("overflow the stack", SIGSEGV)));

TEST(SharedLibraryProgramTest, ACrashBeforeTheFlightIsNamedByServerAndClient) {
  TemporaryFolder folder;
  OwnDomain domain;
  const std::string plant = make_plant_scenario(folder, "in: create, do: crash");
  Outcome outcome = run(make_command("sim_server", domain.number(), {"--scenario", plant}));
  EXPECT_EQ(outcome.code, 128 + SIGSEGV);
  EXPECT_EQ(outcome.output,
            "sim_server: error: " + kPlant + ": create, vehicle 0, step 0: crashed (signal 11)\n");

  const std::string law = make_controller_scenario(folder, "in: create, do: crash");
  outcome = run(make_command("control_client", domain.number(), {"--scenario", law}));
  EXPECT_EQ(outcome.code, 128 + SIGSEGV);
  EXPECT_EQ(outcome.output, "control_client: error: " + kController +
                                ": create, vehicle 0, step 0: crashed (signal 11)\n");
}

TEST(SharedLibraryProgramTest, ALibraryThatIsRefusedEndsServerAndClientWithItsLine) {
  TemporaryFolder folder;
  const std::string plant = make_plant_scenario(folder, "in: create");
  const std::string refusal = ": failed without saying why\n";
  Outcome outcome = run({program("sim_server"), "--check", "--scenario", plant});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(outcome.output,
            "sim_server: error: " + plant + ":6: plant.parameters: " + kPlant + refusal);

  const std::string autopilot = make_autopilot_scenario(folder, "in: create");
  for (const std::vector<std::string>& command :
       {std::vector{program("sim_server"), std::string("--check")}, {program("closed_loop")}}) {
    std::vector<std::string> whole = command;
    whole.insert(whole.end(), {"--scenario", autopilot});
    outcome = run(whole);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_TRUE(holds(outcome.output, ": error: " + autopilot +
                                          ":14: autopilot.parameters: " + kAutopilot + refusal))
        << outcome.output;
  }

  const std::string law = make_controller_scenario(folder, "in: create");
  for (const std::string name : {"control_client", "closed_loop"}) {
    outcome = run({program(name), "--scenario", law});
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.output,
              name + ": error: " + law + ":11: controller.parameters: " + kController + refusal);
  }
}

TEST(SharedLibraryProgramTest, ALibraryThatIsRefusedLeavesTheRecordingThatIsThere) {
  TemporaryFolder folder;
  const auto fly = [&](const std::string& parameters) {
    return run({program("closed_loop"), "--out", folder / "recording", "--force", "--scenario",
                make_controller_scenario(folder, parameters)});
  };
  EXPECT_EQ(fly("in: nothing").code, 0);
  const std::string manifest = read_bytes(folder / "recording/manifest.json");
  EXPECT_EQ(fly("in: create").code, 2);
  EXPECT_EQ(read_bytes(folder / "recording/manifest.json"), manifest);
}

TEST(SharedLibraryProgramTest, ACrashWhileALibraryIsLoadedIsNamed) {
  TemporaryFolder folder;
  const std::string library = std::string(SLS_LIBRARIES) + "/crashing_at_load.so";
  const std::string file = make_scenario(
      folder,
      {{"  gains: { lqr: { horizontal: 10, vertical: 5 } }\n", "  law: " + library + "\n"}});
  EXPECT_EQ(
      run({program("closed_loop"), "--scenario", file}).output,
      "closed_loop: error: " + library + ": (loading), vehicle 0, step 0: crashed (signal 11)\n");
}

TEST(SharedLibraryProgramTest, AnErrorInDestroyIsNamedAndHarmsNoFlight) {
  TemporaryFolder folder;
  const Outcome outcome = run({program("closed_loop"), "--scenario",
                               make_controller_scenario(folder, "in: destroy, do: throw")});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_TRUE(holds(outcome.output, "closed_loop: warning: " + kController +
                                        ": destroy, vehicle 0, step 0: threw an exception: out of "
                                        "luck\n"))
      << outcome.output;
}

TEST(SharedLibraryProgramTest, CheckPurityLooksBeyondTheFirst100Steps) {
  TemporaryFolder folder;
  const std::string file = make_controller_scenario(folder, "in: answer, at: 150, do: remember");
  EXPECT_EQ(run({program("closed_loop"), "--scenario", file}).code, 0);
  const Outcome outcome = run({program("closed_loop"), "--scenario", file, "--check-purity"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_TRUE(holds(outcome.output, kController + ": vehicle 0, step 150: expected equal answers"))
      << outcome.output;
}

TEST(SharedLibraryProgramTest, AFailedRecordingHoldsTheLibrarysMessage) {
  TemporaryFolder folder;
  const Outcome outcome = run({program("closed_loop"), "--out", folder / "recording", "--scenario",
                               make_controller_scenario(folder, "in: answer, at: 5, do: fail")});
  const std::string message = kController + ": answer, vehicle 0, step 5: no solution after 20 ";
  EXPECT_EQ(outcome.code, 1);
  EXPECT_TRUE(holds(outcome.output, message)) << outcome.output;
  const std::string statuses = read_bytes(folder / "recording/status.csv");
  EXPECT_TRUE(holds(statuses, message)) << statuses;
}

/// Without shared memory, because a process that ends during a call would leave its segment behind.
FlightOptions over_udp() {
  FlightOptions options;
  options.qos_file = qos("udp");
  return options;
}

void expect_line(const std::string& output, const std::string& line) {
  EXPECT_TRUE(std::regex_search(output, std::regex("(^|\n)" + line + "\n"))) << output;
}

TEST(SharedLibraryProgramTest, AnErrorInFlightEndsTheClientAndTheServerNamesIt) {
  TemporaryFolder folder;
  FlightOptions options = over_udp();
  options.client = {"--check-purity"};
  Flight flight(make_controller_scenario(folder, "in: answer, at: 150, do: remember"), options);
  flight.wait();
  EXPECT_EQ(flight.client->wait(), 1);
  expect_line(
      flight.client->output(),
      "control_client: error: " + kController +
          ": vehicle 0, step 150: expected equal answers to equal inputs, got two different "
          "ones; what the law must remember belongs into its memory numbers");
  EXPECT_EQ(flight.server->wait(), 1);
  expect_line(flight.server->output(),
              "sim_server: error: step 150: waited 4 s for controller 'control_client' \\(gone\\)");
}

TEST(SharedLibraryProgramTest, AControllerThatNeverReturnsIsNamedAndEndsAfterTheRun) {
  TemporaryFolder folder;
  Flight flight(make_controller_scenario(folder, "in: answer, at: 5, do: hang"), over_udp());
  flight.wait();
  EXPECT_EQ(flight.server->wait(), 1);
  expect_line(flight.server->output(),
              "sim_server: error: step 5: waited 4 s for controller 'control_client' on .*");
  EXPECT_EQ(flight.client->wait(), 1);
  const std::string place = kController + ": answer, vehicle 0, step 5: has not returned for ";
  expect_line(flight.client->output(), "control_client: warning: " + place + "[0-9]+ s");
  // Less than the minute that a call may take in flight.
  expect_line(flight.client->output(),
              "control_client: error: " + place + "[0-5]?[0-9] s: ends the program");
}

TEST(SharedLibraryProgramTest, EveryCallThatDoesNotReturnIsNamed) {
  TemporaryFolder plant_folder, law_folder;
  const std::string plant = make_plant_scenario(plant_folder, "in: measure, at: 8, do: hang");
  const std::string law = make_controller_scenario(law_folder, "in: create, do: hang");
  Process in_plant({program("closed_loop"), "--scenario", plant});
  Process in_client({program("control_client"), "--scenario", law});
  const auto names = [](const Process& process, const std::string& place) {
    return wait_until([&] { return holds(process.output(), place + ": has not returned for "); });
  };
  EXPECT_TRUE(names(in_plant, "closed_loop: warning: " + kPlant + ": measure, vehicle 0, step 8"));
  EXPECT_TRUE(
      names(in_client, "control_client: warning: " + kController + ": create, vehicle 0, step 0"));
}

TEST(SharedLibraryProgramTest, APlantThatFailsEndsTheRunWithItsLine) {
  TemporaryFolder folder;
  Flight flight(make_plant_scenario(folder, "in: advance, at: 8, do: fail"), over_udp());
  flight.wait();
  const std::string failure = kPlant + ": advance, vehicle 0, step 8: the rope is torn";
  EXPECT_EQ(flight.server->wait(), 1);
  expect_line(flight.server->output(), "sim_server: error: " + failure);
  EXPECT_EQ(flight.client->wait(), 1);
  expect_line(flight.client->output(), "control_client: error: the run failed: " + failure);
}

}  // namespace
}  // namespace sls::test
