/// Foreign clients, each with one mistake, join the project's programs. The program that detects
/// the mistake prints one line about it within 2 s, and `sim_ctl status` shows it.
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/bus/topics.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

using namespace std::chrono_literals;
using Words = std::vector<std::string>;

constexpr auto kMostTime = 2000ms;

/// The vehicle is at rest and must stay there: for half a second of simulation, then ten minutes.
constexpr const char* kScenario =
    "name: hang\n"
    "vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }\n"
    "plant:\n"
    "  pendulum: ideal\n"
    "  step_s: 0.001\n"
    "  initial: { load_position_m: [0, 0, -0.5] }\n"
    "sync: { mode: lockstep, period_s: 0.004, wait_for: { controllers: 1, recorders: 1, timeout_s: "
    "60 } }\n"
    "controller:\n"
    "  gains: { lqr: { horizontal: 10, vertical: 5 } }\n"
    "  force_limit_n: 200\n"
    "mission:\n"
    "  - set_point: { position_m: [0, 0, -0.5] }\n"
    "    for_s: 0.5\n"
    "  - set_point: { position_m: [0, 0, -0.5] }\n"
    "    for_s: 600\n";

/// Server and recorder, which wait for a controller.
class ForeignTest : public testing::Test {
 protected:
  void start(const Words& server_flags = {}) {
    std::ofstream(scenario_) << kScenario;
    recorder = start_program("recorder", {"--out", folder_ / "recording"});
    server = start_program("sim_server", Words{"--scenario", scenario_} + server_flags);
    ASSERT_TRUE(wait_until([this] { return has(*server, "waiting for: controller ("); }))
        << server->output();
  }
  std::unique_ptr<Process> start_program(const std::string& name, const Words& flags) const {
    return std::make_unique<Process>(make_command(name, domain_.number(), flags));
  }
  /// Starts the client with `flags`; returns when its mistake becomes visible.
  std::unique_ptr<Process> start_foreign(const Words& flags) const {
    Words command = {SLS_FOREIGN_CLIENTS "/foreign_client", "--domain", domain_.text()};
    command.insert(command.end(), flags.begin(), flags.end());
    return start_and_wait(command);
  }
  static std::unique_ptr<Process> start_and_wait(const Words& command) {
    auto client = std::make_unique<Process>(command);
    EXPECT_TRUE(wait_until([&] { return has(*client, "begins\n"); })) << client->output();
    return client;
  }

  static bool has(const Process& process, const std::string& text) {
    return process.output().find(text) != std::string::npos;
  }
  std::string outputs() const { return server->output() + recorder->output(); }

  /// Expects that `program` prints one of `lines` completely, once and in time.
  void expect_line(const std::string& name, const Process& program, const Words& lines,
                   std::chrono::milliseconds most_time = kMostTime) const {
    const auto began = std::chrono::steady_clock::now();
    const auto count = [&](const std::string& line) {
      const std::string text = program.output(), whole = name + ": warning: " + line + "\n";
      std::size_t found = 0;
      for (auto at = text.find(whole); at != text.npos; at = text.find(whole, at + 1)) ++found;
      return found;
    };
    const auto count_all = [&] {
      std::size_t found = 0;
      for (const std::string& line : lines) found += count(line);
      return found;
    };
    EXPECT_TRUE(wait_until([&] { return count_all() > 0; }, 20s)) << lines[0] << "\n" << outputs();
    const auto time = std::chrono::steady_clock::now() - began;
    EXPECT_LE(time, most_time) << lines[0] << "\n" << outputs();
    RecordProperty(
        "milliseconds",
        std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(time).count()));
    EXPECT_EQ(count_all(), 1u) << outputs();
  }
  void expect_server_line(const std::string& line) { expect_server_line(Words{line}); }
  void expect_server_line(const Words& lines) {
    expect_line("sim_server", *server, lines);
    const std::string problem = ask_problem();
    EXPECT_NE(std::find(lines.begin(), lines.end(), problem), lines.end()) << problem;
  }
  std::string ask_problem() const {
    Process ctl(make_command("sim_ctl", domain_.number(), {"status", "--json"}));
    EXPECT_EQ(ctl.wait(), 0) << ctl.output();
    const std::string text = ctl.output();
    const auto json = nlohmann::json::parse(text.substr(text.find('{')), nullptr, false);
    return json.is_object() && json.contains("problem") ? json.at("problem").get<std::string>()
                                                        : text;
  }
  /// Expects that `program` has printed exactly `warnings` warnings.
  void expect_no_other_warnings(const Process& program, std::size_t warnings) const {
    const std::string text = program.output();
    std::size_t found = 0;
    for (auto at = text.find(": warning: "); at != text.npos; at = text.find(": warning: ", at + 1))
      ++found;
    EXPECT_EQ(found, warnings) << text;
  }

  std::string run_id() const {
    const std::string text = server->output();
    return text.substr(text.find("run ") + 4, 16);
  }
  std::string scenario_sha256() const {
    return nlohmann::json::parse([this] {
             Process ctl(make_command("sim_ctl", domain_.number(), {"status", "--json"}));
             EXPECT_EQ(ctl.wait(), 0) << ctl.output();
             return ctl.output().substr(ctl.output().find('{'));
           }())
        .at("scenario_sha256");
  }

  const TemporaryFolder folder_;
  const OwnDomain domain_;
  const std::string scenario_ = folder_ / "hang.yaml";
  std::unique_ptr<Process> recorder, server;
};

// --- announcements -------------------------------------------------------------------------------

const std::string kWho = "controller 'foreign' on elsewhere: ";

TEST_F(ForeignTest, AnotherContract) {
  start();
  const auto client = start_foreign({"--mistake", "other_contract"});
  expect_server_line(kWho + "sls/participant contract_sha256: expected " + bus::kContractSha256 +
                     ", got " + std::string(64, '0'));
  expect_no_other_warnings(*server, 1);  // the client is not counted as ready: no step is flown
  EXPECT_FALSE(wait_until([&] { return has(*server, "step 0: "); }, 1s)) << outputs();
}

TEST_F(ForeignTest, NoContract) {
  start();
  const auto client = start_foreign({"--mistake", "no_contract"});
  expect_server_line(kWho + "sls/participant contract_sha256: expected " + bus::kContractSha256 +
                     ", got none");
}

TEST_F(ForeignTest, RunIdOfZero) {
  start();
  const auto client = start_foreign({"--mistake", "zero_run_id"});
  expect_server_line(kWho + "sls/participant run_id: expected " + run_id() + ", got 0");
}

TEST_F(ForeignTest, RunIdOfNoServer) {
  start();
  const auto client = start_foreign({"--mistake", "other_run_id"});
  expect_server_line(kWho + "sls/participant run_id: expected " + run_id() +
                     ", got 0000000000001234");
}

TEST_F(ForeignTest, VehicleOfNoServer) {
  start();
  const auto client = start_foreign({"--mistake", "unknown_vehicle"});
  expect_server_line(kWho + "sls/participant vehicle_ids: expected 0, got 7");
}

TEST_F(ForeignTest, AnotherScenario) {
  start();
  const std::string expected = scenario_sha256();
  const auto client = start_foreign({"--mistake", "other_scenario"});
  expect_server_line(kWho + "sls/participant scenario_sha256: expected " + expected + ", got " +
                     std::string(64, 'f'));
}

TEST_F(ForeignTest, NoAnnouncement) {
  start();
  const auto client = start_foreign({"--mistake", "unannounced"});
  expect_server_line(
      "'foreign' (127.0.0.1): writes sls/command: expected an announcement in sls/participant, got "
      "none");
}

TEST_F(ForeignTest, NoAnnouncementByAWriterOfAnnouncements) {
  start();
  const auto client = start_foreign({"--mistake", "unannounced_writer"});
  expect_server_line(
      "'foreign' (127.0.0.1): writes sls/command: expected an announcement in sls/participant, got "
      "none");
}

TEST_F(ForeignTest, AnotherLibraryThanTheClientThatWasReadyFirst) {
  start();
  const auto first = start_foreign({"--name", "first", "--library", std::string(64, 'a')});
  ASSERT_TRUE(wait_until([&] { return ask_problem().empty(); }));
  const auto standby = start_foreign({"--name", "standby", "--library", std::string(64, 'b')});
  expect_server_line(
      "controller 'standby' on elsewhere: sls/participant library_sha256: expected " +
      std::string(64, 'a') + " (that of 'first'), got " + std::string(64, 'b') + "; it is refused");
}

// --- endpoints -----------------------------------------------------------------------------------

struct EndpointMistake {
  const char* name;
  const char* line;
  bool is_recorders = false;  ///< the recorder also has an endpoint of that topic
};

class ForeignEndpointTest : public ForeignTest,
                            public testing::WithParamInterface<EndpointMistake> {};

TEST_P(ForeignEndpointTest, IsNamed) {
  start();
  const auto client = start_foreign({"--mistake", GetParam().name});
  expect_server_line(GetParam().line);
  if (GetParam().is_recorders)
    EXPECT_TRUE(has(*recorder, std::string("recorder: warning: ") + GetParam().line)) << outputs();
  else
    expect_no_other_warnings(*recorder, 0);
}

INSTANTIATE_TEST_SUITE_P(
    Mistakes, ForeignEndpointTest,
    testing::Values(
        EndpointMistake{"volatile_announcement",
                        "sls/participant of 'foreign' (127.0.0.1): DURABILITY: offered volatile, "
                        "asked transient local",
                        true},
        EndpointMistake{"best_effort_announcement",
                        "sls/participant of 'foreign' (127.0.0.1): RELIABILITY: offered best "
                        "effort, asked reliable",
                        true},
        EndpointMistake{"exclusive_command",
                        "sls/command of 'foreign' (127.0.0.1): OWNERSHIP: offered exclusive, asked "
                        "shared"},
        EndpointMistake{"state_deadline",
                        "sls/state for 'foreign' (127.0.0.1): DEADLINE: offered none, asked "
                        "0.01 s"},
        EndpointMistake{"record_deadline",
                        "sls/record for 'foreign' (127.0.0.1): DEADLINE: offered none, asked "
                        "0.01 s"},
        EndpointMistake{"other_type",
                        "sls/command of 'foreign' (127.0.0.1): type: expected sls::Commands, got "
                        "mine::Commands"},
        EndpointMistake{"keyed_command",
                        "sls/command of 'foreign' (127.0.0.1): key: expected none, got a keyed "
                        "type"},
        EndpointMistake{"similar_topic",
                        "sls/commands of 'foreign' (127.0.0.1): expected topic sls/command", true},
        EndpointMistake{"ros_topic",
                        "rt/sls/command of 'foreign' (127.0.0.1): expected topic sls/command "
                        "(without the prefix of ROS 2)",
                        true}),
    [](const auto& mistake) { return std::string(mistake.param.name); });

TEST_F(ForeignTest, StatesWithoutAClaim) {
  start();
  const auto client = start_foreign({"--mistake", "states_without_claim"});
  expect_server_line(
      "'foreign' (127.0.0.1): writes sls/state, sls/status: expected a claim in sls/parameters, "
      "got none; its samples are ignored");
}

/// It says that the run has failed. Server and client name it and fly on.
TEST_F(ForeignTest, StatusAndStatesOfAnotherServersRun) {
  start();
  const auto client = start_program("control_client", {"--scenario", scenario_});
  ASSERT_TRUE(wait_until([&] { return has(*client, "joins run"); })) << client->output();
  const auto impostor = start_foreign({"--mistake", "impostor"});
  const auto line = [this](const char* topic, const char* owner) {
    return std::string("'foreign' (127.0.0.1): ") + topic +
           " run_id: expected that of a run of its own, got " + run_id() + ", a run of " + owner +
           "; its samples are ignored";
  };
  expect_server_line(line("sls/status", "this server"));
  expect_line("control_client", *client,
              {line("sls/status", "'sim_server' (127.0.0.1)"),
               line("sls/state", "'sim_server' (127.0.0.1)")});
  EXPECT_TRUE(server->is_running() && client->is_running()) << outputs() << client->output();
}

TEST_F(ForeignTest, NoDeadlineInRealTime) {
  start({"--mode", "realtime"});
  const auto client = start_foreign({"--mistake", "no_deadline"});
  expect_server_line("sls/command of 'foreign' (127.0.0.1): DEADLINE: offered none, asked 0.1 s");
}

TEST_F(ForeignTest, NoDeadlineInLockstepIsNoMistake) {
  start();
  const auto client = start_foreign({"--mistake", "no_deadline"});
  EXPECT_TRUE(wait_until([&] { return has(*recorder, "records run"); }));
  EXPECT_FALSE(wait_until([&] { return has(*server, ": warning: "); }, 2s)) << outputs();
  EXPECT_EQ(ask_problem(), "");
}

TEST_F(ForeignTest, AppendableTypesOfCyclone) {
  if (!SLS_HAS_CYCLONE)
    GTEST_SKIP() << "built without Cyclone DDS: apt-get install cyclonedds-dev cyclonedds-tools";
  start();
  const auto client = start_and_wait(
      {"env",
       "CYCLONEDDS_URI=<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\" "
       "multicast=\"true\"/></Interfaces></General></Domain></CycloneDDS>",
       SLS_FOREIGN_CLIENTS "/appendable_client", domain_.text()});
  const std::string written =
      " of 'appendable' (127.0.0.1): DATA_REPRESENTATION: offered XCDR2, "
      "asked XCDR1 (compile the types as @final)";
  // The line names the endpoint that is discovered first.
  expect_server_line({"sls/participant" + written, "sls/command" + written,
                      "sls/state for 'appendable' (127.0.0.1): DATA_REPRESENTATION: offered XCDR1, "
                      "asked XCDR2 (compile the types as @final)"});
  expect_no_other_warnings(*server, 1);
  expect_line("recorder", *recorder, {"sls/participant" + written});
}

// --- samples -------------------------------------------------------------------------------------

TEST_F(ForeignTest, AnnouncementsWithAFieldMore) {
  start();
  const auto client = start_foreign({"--mistake", "announcement_extra_field"});
  const std::string line =
      "sls/participant of 'foreign' (127.0.0.1): sls::Participant: expected 220 bytes, got 228";
  expect_server_line(line);
  expect_line("recorder", *recorder, {line});
}

TEST_F(ForeignTest, CommandsWithAFieldMoreAmidTheOthers) {
  start();
  const auto client = start_foreign({"--mistake", "extra_field"});
  expect_server_line(
      "sls/command of 'foreign' (127.0.0.1): sls::Commands: expected more bytes, got 252");
}

TEST_F(ForeignTest, CommandsWithAFieldLess) {
  start();
  const auto client = start_foreign({"--mistake", "missing_field"});
  expect_server_line(
      "sls/command of 'foreign' (127.0.0.1): sls::Commands: expected more bytes, got 236");
}

TEST_F(ForeignTest, CommandsWithAFieldOfAnotherType) {
  start();
  const auto client = start_foreign({"--mistake", "retyped_field"});
  expect_server_line(
      "sls/command of 'foreign' (127.0.0.1): sls::Commands: expected more bytes, got 240");
}

// --- answers -------------------------------------------------------------------------------------

/// The line contains the number of answers, which depends on how often the state was sent again.
class ForeignAnswerTest : public ForeignTest {
 protected:
  void expect_rejected(const std::string& cause) {
    const std::string begin = kWho + "sls/command: ",
                      end = " answers rejected, none taken: " + cause;
    std::string line;
    EXPECT_TRUE(wait_until(
        [&] {
          const std::string text = server->output();
          const auto at = text.find("sim_server: warning: " + begin);
          if (at == text.npos) return false;
          line = text.substr(at + 21, text.find('\n', at) - at - 21);
          return true;
        },
        2s))
        << outputs();
    EXPECT_EQ(line.substr(line.find(" answers")), end);
    EXPECT_EQ(ask_problem(), line);
    // The waiting line names the awaited client and the cause, in its own text or as a problem.
    EXPECT_TRUE(wait_until([&] {
      const bool is_of_awaited =
          has(*server, " of its answers rejected, none taken: " + cause + ") (");
      return has(*server, "step 0: waiting for: controller 'foreign' on elsewhere (") &&
             (is_of_awaited || has(*server, " s left); " + line));
    })) << outputs();
  }
};

TEST_F(ForeignAnswerTest, OfAnotherRun) {
  start();
  const auto client = start_foreign({"--mistake", "wrong_run"});
  expect_rejected("run_id: expected " + run_id() + ", got 0000000000001234");
}

TEST_F(ForeignAnswerTest, ForAnotherVehicle) {
  start();
  const auto client = start_foreign({"--mistake", "wrong_vehicle"});
  expect_rejected("vehicle_id: expected 0, got 7");
}

TEST_F(ForeignAnswerTest, ToStepsThatAreNotPublished) {
  start({"--mode", "realtime"});
  const auto client = start_foreign({"--mistake", "early"});
  expect_server_line(kWho + "sls/command step: expected at most 0, the last published, got 2");
}

struct ClientMistake {
  const char* name;
  const char* line;  ///< after kWho
};

class ForeignMistakeTest : public ForeignTest, public testing::WithParamInterface<ClientMistake> {};

TEST_P(ForeignMistakeTest, IsNamed) {
  start();
  const auto client = start_foreign({"--mistake", GetParam().name});
  expect_server_line(kWho + GetParam().line);
}

INSTANTIATE_TEST_SUITE_P(
    Mistakes, ForeignMistakeTest,
    testing::Values(
        ClientMistake{"never_ready",
                      "sls/participant ready: expected true, as its endpoints are matched, got "
                      "false"},
        ClientMistake{"no_state_reader", "expected a reader of sls/state, got none"},
        ClientMistake{"done",
                      "sls/participant done: expected false, as it still answers, got true"},
        ClientMistake{"empty",
                      "sls/command vehicles at step 0: expected at least one answer, got none"},
        ClientMistake{"other_name",
                      "sls/command client_name: expected 'foreign', as announced, got 'another'"}),
    [](const auto& mistake) { return std::string(mistake.param.name); });

TEST_F(ForeignTest, ARecorderThatWritesCommands) {
  start();
  const auto client = start_foreign({"--mistake", "role_recorder"});
  expect_server_line(
      "recorder 'foreign' on elsewhere: sls/participant role: expected controller, as it writes "
      "sls/command, got recorder");
}

TEST_F(ForeignAnswerTest, InAHundredCopies) {
  start();
  const auto client = start_foreign({"--mistake", "flood"});
  expect_server_line(kWho +
                     "sls/command: expected one answer to each state, got over 30 copies of each");
}

TEST_F(ForeignAnswerTest, TwoToOneStep) {
  start();
  const auto client = start_foreign({"--mistake", "two_answers"});
  expect_server_line(kWho + "sls/command step 0: expected one answer, got two that differ");
}

TEST_F(ForeignAnswerTest, WithoutTheStageThatWasReturned) {
  start();
  const auto client = start_foreign({"--mistake", "memory_lost"});
  expect_server_line(kWho +
                     "sls/command controller.stage_index at step 250: expected at least 1, as in "
                     "the state, got 0");
}

TEST_F(ForeignAnswerTest, WithoutTheNumbersThatWereReturned) {
  start();
  const auto client = start_foreign({"--mistake", "numbers_lost"});
  expect_server_line(kWho +
                     "sls/command controller.numbers at step 250: expected 3 of them, as before, "
                     "got 0");
}

TEST_F(ForeignAnswerTest, OfAMissionThatNeverAdvances) {
  start();
  const auto client = start_foreign({"--mistake", "stuck"});
  expect_server_line(kWho +
                     "sls/command controller.stage_index at step 376: expected more than 0 (stage "
                     "'set_point' was over at 0.5 s), got 0 and mission running");
}

TEST_F(ForeignAnswerTest, ThatFlyFarFromTheReferenceAreAnnouncedOnce) {
  start();
  const auto client = start_foreign({"--mistake", "far"});
  expect_line("sim_server", *server,
              {"step 729: vehicle 0: quadrotor 50.07 m from its reference, expected at most 50 rod "
               "lengths (50 m)"});
  EXPECT_TRUE(server->is_running());
  EXPECT_EQ(ask_problem(), "");
}

// --- no mistake ----------------------------------------------------------------------------------

TEST_F(ForeignTest, ALongWaitSuggestsTheDoctor) {
  start();
  EXPECT_TRUE(wait_until([&] { return has(*server, " s left)"); }));
  EXPECT_FALSE(has(*server, "doctor")) << outputs();
  EXPECT_TRUE(wait_until([&] { return has(*server, "run ./sls doctor\n"); }, 10s)) << outputs();
}

TEST_F(ForeignTest, OurOwnProgramsMakeNoMistakes) {
  for (const char* mode : {"lockstep", "realtime"}) {
    FlightOptions options;
    options.server = {"--mode", mode};
    Flight flight(::sls::test::scenario("short"), options);
    flight.expect_success();
    EXPECT_EQ(flight.outputs().find(": warning: "), std::string::npos) << flight.outputs();
  }
}

}  // namespace
}  // namespace sls::test
