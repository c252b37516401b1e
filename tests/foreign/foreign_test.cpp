/// Foreign clients, each with one mistake, join the project's programs. The program that detects
/// the mistake prints one line about it, and `sim_ctl status` shows it.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

/// The vehicle is at rest and must stay there for ten minutes.
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
    "    for_s: 600\n";

/// Server and recorder, which wait for a controller.
class ForeignTest : public ProgramsTest {
 protected:
  void start(const Words& server_flags = {}) {
    std::ofstream(scenario_) << kScenario;
    recorder = Programs::start("recorder", {"--out", recording()});
    server = Programs::start("sim_server", Words{"--scenario", scenario_} + server_flags);
    ASSERT_TRUE(wait_for_text(*server, "waiting for: controller (")) << server->output();
  }
  /// Starts the client with `flags`; returns when its mistake becomes visible.
  std::unique_ptr<Process> start_foreign(const Words& flags) const {
    auto client = std::make_unique<Process>(
        Words{SLS_FOREIGN_CLIENTS "/foreign_client", "--domain", domain.text()} + flags);
    EXPECT_TRUE(wait_for_text(*client, "begins\n")) << client->output();
    return client;
  }

  std::string outputs() const { return server->output() + recorder->output(); }

  /// Expects that `program` prints one of `lines` completely and once.
  void expect_line(const std::string& name, const Process& program, const Words& lines) const {
    const auto count_all = [&] {
      const std::string text = program.output();
      std::size_t found = 0;
      for (const std::string& line : lines) {
        const std::string whole = name + ": warning: " + line + "\n";
        for (auto at = text.find(whole); at != text.npos; at = text.find(whole, at + 1)) ++found;
      }
      return found;
    };
    EXPECT_TRUE(wait_until([&] { return count_all() > 0; })) << lines[0] << "\n" << outputs();
    EXPECT_EQ(count_all(), 1u) << outputs();
  }
  void expect_server_line(const std::string& line) { expect_server_line(Words{line}); }
  void expect_server_line(const Words& lines) {
    expect_line("sim_server", *server, lines);
    const std::string problem = ask_problem();
    EXPECT_NE(std::find(lines.begin(), lines.end(), problem), lines.end()) << problem;
  }
  std::string ask_problem() const {
    const std::string text =
        expect_exit(make_command("sim_ctl", domain.number(), {"status", "--json"}));
    const auto json = nlohmann::json::parse(text.substr(text.find('{')), nullptr, false);
    return json.is_object() && json.contains("problem") ? json.at("problem").get<std::string>()
                                                        : text;
  }
  /// The lines about mistakes. On a busy machine programs may also wait for each other or be late.
  static std::ptrdiff_t count_mistakes(const std::string& text) {
    const std::regex line(
        ": warning: (?!.*(waiting for: | computes an answer)).*(expected|offered|rejected)");
    return std::distance(std::sregex_iterator(text.begin(), text.end(), line),
                         std::sregex_iterator());
  }

  std::string run_id() const {
    const std::string text = server->output();
    return text.substr(text.find("run ") + 4, 16);
  }

  const std::string scenario_ = folder / "hang.yaml";
  std::unique_ptr<Process> recorder, server;
};

// --- one mistake ---------------------------------------------------------------------------------

const std::string kWho = "controller 'foreign' on elsewhere: ";

struct Mistake {
  const char* name;
  const char* line;           ///< CLIENT is 'NAME' (127.0.0.1)
  bool is_recorders = false;  ///< the recorder also has an endpoint of that topic
};
struct Mistakes {
  const char* name;
  std::vector<Mistake> all;  ///< at most five: a program prints no more in 10 s
};

class ForeignMistakesTest : public ForeignTest, public testing::WithParamInterface<Mistakes> {};

/// Mistakes that the middleware sees, of as many clients at the same time. All the others, the
/// texts and how long they must last: ParticipantCheckTest and NeighboursTest.
TEST_P(ForeignMistakesTest, AreNamed) {
  start();
  std::vector<std::unique_ptr<Process>> clients;
  for (const Mistake& mistake : GetParam().all)
    clients.push_back(start_foreign({"--mistake", mistake.name, "--name", mistake.name}));
  for (const Mistake& mistake : GetParam().all) {
    const std::string who = std::string("'") + mistake.name + "' (127.0.0.1)",
                      line = ": warning: " + replace_once(mistake.line, "CLIENT", who);
    EXPECT_TRUE(wait_for_text(*server, line)) << line << "\n" << outputs();
    EXPECT_TRUE(wait_until([&] { return holds(recorder->output(), line) == mistake.is_recorders; }))
        << line << "\n"
        << outputs();
  }
}

INSTANTIATE_TEST_SUITE_P(
    , ForeignMistakesTest,
    testing::Values(
        Mistakes{
            "OfAnnouncements",
            {{"volatile",
              "sls/participant of CLIENT: DURABILITY: offered volatile, asked transient local",
              true},
             {"best_effort",
              "sls/participant of CLIENT: RELIABILITY: offered best effort, asked reliable", true},
             {"long_announcement", "sls/participant of CLIENT: sls::Participant: expected ", true},
             {"unannounced",
              "CLIENT: writes sls/command: expected an announcement in sls/participant, got "
              "none"}}},
        Mistakes{
            "OfEndpoints",
            {{"exclusive", "sls/command of CLIENT: OWNERSHIP: offered exclusive, asked shared"},
             {"keyed", "sls/command of CLIENT: key: expected none, got a keyed type"},
             {"other_type",
              "sls/command of CLIENT: type: expected sls::Commands, got mine::Commands"},
             {"state_deadline", "sls/state for CLIENT: DEADLINE: offered none, asked 0.01 s"},
             {"record_deadline", "sls/record for CLIENT: DEADLINE: offered none, asked 0.01 s"}}},
        Mistakes{
            "OfTopics",
            {{"similar_topic", "sls/commands of CLIENT: expected topic sls/command", true},
             {"ros_topic",
              "rt/sls/command of CLIENT: expected topic sls/command (without the prefix of ROS 2)",
              true},
             {"states_without_claim",
              "CLIENT: writes sls/state, sls/status: expected a claim in sls/parameters, got none; "
              "its samples are ignored",
              true}}},
        Mistakes{
            "OfSamples",
            {{"extra_field", "sls/command of CLIENT: sls::Commands: expected more bytes, got "},
             {"missing_field", "sls/command of CLIENT: sls::Commands: expected more bytes, got "},
             {"retyped_field",
              "sls/command of CLIENT: sls::Commands: expected more bytes, got "}}}),
    [](const auto& mistakes) { return std::string(mistakes.param.name); });

TEST_F(ForeignTest, NoReaderOfStates) {
  start();
  const auto client = start_foreign({"--mistake", "no_state_reader"});
  expect_server_line(kWho + "expected a reader of sls/state, got none");
}

/// It says that the run has failed. Server and client name it and fly on.
TEST_F(ForeignTest, StatusAndStatesOfAnotherServersRun) {
  start();
  const auto client = Programs::start("control_client", {"--scenario", scenario_});
  ASSERT_TRUE(wait_for_text(*client, "joins run")) << client->output();
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

TEST_F(ForeignTest, AppendableTypesOfCyclone) {
  if (!SLS_HAS_CYCLONE)
    GTEST_SKIP() << "built without Cyclone DDS: apt-get install cyclonedds-dev cyclonedds-tools";
  start();
  Process client(
      {"env",
       "CYCLONEDDS_URI=<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\" "
       "multicast=\"true\"/></Interfaces></General></Domain></CycloneDDS>",
       SLS_FOREIGN_CLIENTS "/appendable_client", domain.text()});
  const std::string written =
      " of 'my_client' (127.0.0.1): DATA_REPRESENTATION: offered XCDR2, "
      "asked XCDR1 (compile the types as @final)";
  const std::string read =
      " for 'my_client' (127.0.0.1): DATA_REPRESENTATION: offered XCDR1, "
      "asked XCDR2 (compile the types as @final)";
  // The line names the endpoint that is discovered first.
  expect_server_line({"sls/participant" + written, "sls/command" + written, "sls/state" + read,
                      "sls/parameters" + read, "sls/status" + read});
  EXPECT_EQ(count_mistakes(server->output()), 1);
  expect_line("recorder", *recorder, {"sls/participant" + written});
}

// --- no mistake ----------------------------------------------------------------------------------

TEST_F(ForeignTest, OurOwnProgramsMakeNoMistakes) {
  for (const char* mode : {"lockstep", "realtime"}) {
    FlightOptions options;
    options.server = {"--mode", mode};
    Flight flight(::sls::test::scenario("short"), options);
    flight.expect_success();
    EXPECT_EQ(count_mistakes(flight.outputs()), 0) << flight.outputs();
  }
}

}  // namespace
}  // namespace sls::test
