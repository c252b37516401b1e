/// Another vendor's DDS: a controller and a recorder in C on Eclipse Cyclone DDS fly and record
/// with the programs of this project.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/network/hosts_flight.hpp"
#include "tests/support/faketime.hpp"

namespace sls::test {
namespace {

const Words kUdp = {"--qos", qos("udp")};

/// Cyclone on loopback only, like the profile `udp`. By default it would use another interface.
const Words kOnLoopback = {
    "env",
    "CYCLONEDDS_URI=<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\" "
    "multicast=\"true\"/></Interfaces></General></Domain></CycloneDDS>"};

/// The result of a cyclone_recorder: the last line of its output.
nlohmann::json read_result(const Process& recorder) {
  const std::string output = recorder.output();
  const auto begin = output.rfind("\n{");
  return begin == std::string::npos ? nlohmann::json::object()
                                    : nlohmann::json::parse(output.substr(begin));
}

std::size_t count_rows(const std::filesystem::path& file) {
  const std::string text = read_file(file);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// Expects that the cyclone_recorder has every step and wrote the same bytes as the project's
/// recorder.
void expect_same_rows(const Process& recorder, const std::filesystem::path& rows,
                      const std::filesystem::path& ours, std::uint64_t last_step) {
  const auto result = read_result(recorder);
  ASSERT_TRUE(result.contains("last_step")) << recorder.output();
  EXPECT_EQ(result.at("last_step"), last_step) << result;
  EXPECT_TRUE(result.at("complete").get<bool>()) << result;
  for (const char* file : {"state.csv", "command.csv", "reference.csv"}) {
    EXPECT_GT(count_rows(ours / file), last_step) << file;
    EXPECT_TRUE(read_file(rows / file) == read_file(ours / file)) << file;
  }
}

class InteropTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!SLS_HAS_CYCLONE)
      GTEST_SKIP() << "built without Cyclone DDS: apt-get install cyclonedds-dev cyclonedds-tools";
    write_quick_scenario(1);
  }

  /// Similar to setpoints.yaml, but shorter: 4,000 steps. With a period of 1 ms it has 16,000,
  /// which leaves time for events in flight.
  void write_quick_scenario(int controllers, int recorders = 1, int vehicles = 1,
                            const char* period_s = "0.004") const {
    std::ofstream(quick_) << "name: quick\n"
                          << (vehicles > 1 ? "vehicles: " + std::to_string(vehicles) + "\n" : "")
                          << "vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, "
                             "gravity_m_s2: 9.8 }\n"
                             "plant:\n"
                             "  pendulum: ideal\n"
                             "  step_s: 0.001\n"
                             "  initial: { load_position_m: [0, 0, -1.5] }\n"
                             "sync: { mode: lockstep, period_s: "
                          << period_s << ", wait_for: { controllers: " << controllers
                          << ", recorders: " << recorders
                          << ", timeout_s: 60 } }\n"
                             "controller:\n"
                             "  gains: { lqr: { horizontal: 10, vertical: 5 } }\n"
                             "  force_limit_n: 200\n"
                             "mission:\n"
                             "  - set_point: { position_m: [1, -1, -2] }\n"
                             "    for_s: 2.5\n"
                             "  - set_point: { position_m: [-1, 1, -1.75] }\n"
                             "    for_s: 13.5\n";
  }

  /// One of the project's programs, over UDP on loopback; its command line follows `before`.
  std::unique_ptr<Process> start(const std::string& name, const Words& flags,
                                 const Words& before = {}) const {
    return std::make_unique<Process>(before + make_command(name, domain_.number(), kUdp + flags));
  }
  /// cyclone_controller or cyclone_recorder.
  std::unique_ptr<Process> start_cyclone(const std::string& name, const Words& flags = {},
                                         const Words& before = kOnLoopback) const {
    return std::make_unique<Process>(
        before + Words{SLS_INTEROP_DIR "/" + name, "--domain", domain_.text()} + flags);
  }
  std::unique_ptr<Process> start_cyclone_recorder() const {
    return start_cyclone("cyclone_recorder", {"--out", rows_});
  }
  std::unique_ptr<Process> start_recorder(const Words& further = {}) const {
    return start("recorder", Words{"--out", recording_} + further);
  }
  std::unique_ptr<Process> start_server(const Words& before = {}) const {
    return start("sim_server", {"--scenario", quick_}, before);
  }
  bool wait_for_steps(std::size_t steps) const {
    return wait_until([&] { return count_rows(recording_ + "/state.csv") > steps; });
  }

  /// The subfolder of the recording with the run after the first.
  std::filesystem::path find_second_run() const {
    for (const auto& entry : std::filesystem::directory_iterator(recording_))
      if (entry.path().filename().string().rfind("run-", 0) == 0) return entry.path();
    return {};
  }

  /// Expects that both flights have the same bytes.
  static void expect_same_flight(const std::filesystem::path& a, const std::filesystem::path& b) {
    for (const char* file : {"state.csv", "reference.csv"})
      EXPECT_TRUE(read_file(a / file) == read_file(b / file)) << file;
    EXPECT_EQ(read_certificate(a), read_certificate(b));
  }

  static constexpr const char* kShortPeriod = "0.001";
  static constexpr std::uint64_t kLongSteps = 16000;
  TemporaryFolder folder_;
  OwnDomain domain_;
  const std::string quick_ = folder_ / "quick.yaml";
  const std::string recording_ = folder_ / "recording";
  const std::string rows_ = folder_ / "rows";  // of the cyclone_recorder
};

TEST_F(InteropTest, ACycloneControllerFliesSetpointsLikeOursAndACycloneRecorderWritesTheSameRows) {
  // The shipped scenario, but the server waits for both recorders.
  const std::string setpoints = folder_ / "setpoints.yaml";
  std::ofstream(setpoints) << replace_once(read_file(scenario("setpoints")), "recorders: 1",
                                           "recorders: 2");
  const auto recorder = start_recorder();
  const auto server = start("sim_server", {"--scenario", setpoints});
  const auto cyclone_recorder = start_cyclone_recorder();
  const auto controller = start_cyclone("cyclone_controller", {"--name", "cyclone"});
  expect_success({server.get(), controller.get(), recorder.get(), cyclone_recorder.get()});
  EXPECT_FALSE(holds(server->output(), "expected")) << server->output();  // no mistake
  const auto manifest = read_manifest(recording_);
  EXPECT_TRUE(manifest.at("complete").get<bool>()) << manifest;
  expect_same_rows(*cyclone_recorder, rows_, recording_, 11250);
  const Table commands(recording_ + "/command.csv");
  ASSERT_EQ(commands.rows(), 11251u);
  EXPECT_EQ(commands.text(11250, "controller"), "cyclone");
  expect_same_flight(recording_, fly_in_process(setpoints, folder_ / "own"));
}

/// Seventy vehicles: two samples per step.
TEST_F(InteropTest, ACycloneControllerFliesAFleetAndACycloneRecorderWritesTheSameRows) {
  write_quick_scenario(1, 2, 70);
  const std::string text = read_file(quick_);
  std::ofstream(quick_) << replace_once(text, "for_s: 13.5", "for_s: 0.5");
  const auto recorder = start_recorder(), server = start_server();
  const auto cyclone_recorder = start_cyclone_recorder();
  const auto controller = start_cyclone("cyclone_controller");
  expect_success({server.get(), controller.get(), recorder.get(), cyclone_recorder.get()});
  EXPECT_TRUE(read_manifest(recording_).at("complete").get<bool>());
  EXPECT_EQ(count_rows(recording_ + "/state.csv"), 1 + 70 * 751u);
  expect_same_rows(*cyclone_recorder, rows_, recording_, 750);
}

TEST_F(InteropTest, ACycloneStandbyTakesOverFromAClientThatIsKilled) {
  write_quick_scenario(2, 1, 1, kShortPeriod);
  const auto recorder = start_recorder(), server = start_server();
  const auto primary =
      start("control_client", {"--scenario", quick_, "--strength", "1", "--name", "primary"});
  const auto standby = start_cyclone("cyclone_controller", {"--name", "standby"});
  ASSERT_TRUE(wait_for_steps(100)) << server->output();
  primary->kill();
  expect_success({server.get(), standby.get(), recorder.get()});
  EXPECT_TRUE(read_manifest(recording_).at("complete").get<bool>());
  const Table commands(recording_ + "/command.csv");
  EXPECT_EQ(commands.text(0, "controller"), "primary");
  EXPECT_EQ(commands.text(kLongSteps, "controller"), "standby");
  write_quick_scenario(1, 1, 1, kShortPeriod);
  expect_same_flight(recording_, fly_in_process(quick_, folder_ / "own"));
}

TEST_F(InteropTest, CycloneControllerAndRecorderFlyOnWithTheServerThatReplacesAKilledOne) {
  write_quick_scenario(1, 1, 1, kShortPeriod);
  const auto recorder = start_recorder({"--follow"});
  auto server = start_server();
  const auto controller = start_cyclone("cyclone_controller"),
             cyclone_recorder = start_cyclone_recorder();
  ASSERT_TRUE(wait_for_steps(100)) << server->output();
  server->kill();
  server = start_server();
  expect_success({server.get(), controller.get(), recorder.get(), cyclone_recorder.get()});
  expect_same_rows(*cyclone_recorder, rows_, find_second_run(), kLongSteps);
}

TEST_F(InteropTest, ALateCycloneRecorderGetsTheMissedSamples) {
  write_quick_scenario(1, 1, 1, kShortPeriod);
  const auto recorder = start_recorder();
  const auto server = start_server(), controller = start_cyclone("cyclone_controller");
  ASSERT_TRUE(wait_for_steps(100)) << server->output();
  controller->send(SIGSTOP);  // the flight pauses until the late recorder has joined
  const auto late_recorder = start_cyclone_recorder();
  EXPECT_TRUE(wait_until([&] { return holds(late_recorder->output(), " run "); }));
  controller->send(SIGCONT);
  expect_success({server.get(), controller.get(), recorder.get(), late_recorder.get()});
  expect_same_rows(*late_recorder, rows_, recording_, kLongSteps);
}

/// On a secured domain.
class SecuredInteropTest : public InteropTest {
 protected:
  void SetUp() override {
    InteropTest::SetUp();
    if (!IsSkipped() && !std::filesystem::exists(SLS_CYCLONE_PLUGINS "/libdds_security_crypto.so"))
      GTEST_SKIP() << "expected Cyclone's security plugins in " SLS_CYCLONE_PLUGINS;
  }
  void make_keys(const Words& flags) const {
    Process process(Words{SLS_SOURCE_DIR "/sls", "keys", keys_} + flags);
    ASSERT_EQ(process.wait(), 0) << process.output();
  }
  Process start_secured(const std::string& name, const Words& flags) const {
    return Process(with_keys_ + make_command(name, domain_.number(), flags, qos("secure")));
  }
  Process start_secured_cyclone() const {
    return Process(with_keys_ +
                   Words{"SLS_IDENTITY=controller", "SLS_CYCLONE_PLUGINS=" SLS_CYCLONE_PLUGINS,
                         "CYCLONEDDS_URI=file://" SLS_SOURCE_DIR
                         "/tests/interop/cyclone_secure.xml",
                         SLS_INTEROP_DIR "/cyclone_controller", "--domain", domain_.text()});
  }

  const std::string keys_ = folder_ / "keys";
  const Words with_keys_ = {"env", "SLS_KEYS=" + keys_};
};

TEST_F(SecuredInteropTest, ACycloneControllerFliesWithKeysForOtherVendors) {
  make_keys({"--other-vendors"});
  Process recorder = start_secured("recorder", {"--out", recording_});
  Process server = start_secured("sim_server", {"--scenario", quick_});
  Process controller = start_secured_cyclone();
  expect_success({&server, &controller, &recorder});
  EXPECT_TRUE(read_manifest(recording_).at("complete").get<bool>());
  EXPECT_FALSE(holds(server.output(), "expected")) << server.output();  // no mistake
}

TEST_F(SecuredInteropTest, ACycloneControllerWithOtherKeysIsNamedWithTheReason) {
  make_keys({});
  Process server = start_secured("sim_server", {"--scenario", quick_});
  Process controller = start_secured_cyclone();
  const std::string who =
      SLS_FASTDDS_VERSION > 2 ? "refused 'cyclone_controller' (" : "'cyclone_controller' (";
  EXPECT_TRUE(wait_until([&] {
    return holds(server.output(),
                 "): another vendor's DDS: expected keys of ./sls keys DIR --other-vendors, got "
                 "keys without it\n");
  })) << server.output();
  EXPECT_TRUE(holds(server.output(), "warning: " + who)) << server.output();
  EXPECT_FALSE(holds(server.output(), "expected an announcement")) << server.output();
}

/// Expects success with each program on its own host. The project's programs use `profile`.
void expect_flight_on_hosts(const Network& network, const std::string& profile,
                            const std::string& scenario_file, const std::string& recording,
                            const Words& configuration) {
  const Profile configured(network, profile);
  const auto start = [&](const std::string& host, const std::string& name, const Words& flags) {
    return std::make_unique<Process>(configured.before(host) +
                                     make_command(name, 0, flags, qos(profile)));
  };
  const auto recorder = start("recorder", "recorder", {"--out", recording});
  const auto server = start("server", "sim_server", {"--scenario", scenario_file});
  Process controller(network.on("controller") + configuration +
                     Words{SLS_INTEROP_DIR "/cyclone_controller"});
  for (Process* process : {server.get(), &controller, recorder.get()})
    EXPECT_EQ(process->wait(), 0) << process->output();
  EXPECT_TRUE(read_manifest(recording).at("complete").get<bool>());
}

/// Without a configuration Cyclone uses the host's network, as profile `lan` does.
TEST_F(InteropTest, ACycloneControllerOnAnotherHostFliesWithProfileLan) {
  if (const auto obstacle = Network::find_obstacle()) GTEST_SKIP() << *obstacle;
  expect_flight_on_hosts(Network(kHosts), "lan", quick_, recording_, {});
}

TEST_F(InteropTest, ACycloneControllerOnAnotherHostFliesWithProfileUnicast) {
  if (const auto obstacle = Network::find_obstacle()) GTEST_SKIP() << *obstacle;
  const Network network(kHosts);
  network.block_multicast();
  std::string peers;
  for (const char* host : {"server", "recorder"})
    peers += "<Peer address=\"" + network.address(host) + "\"/>";
  expect_flight_on_hosts(
      network, "unicast", quick_, recording_,
      {"env",
       "CYCLONEDDS_URI=<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast>"
       "</General><Discovery><ParticipantIndex>auto</ParticipantIndex><Peers>" +
           peers + "</Peers></Discovery></Domain></CycloneDDS>"});
}

// --- examples/my_client --------------------------------------------------------------------------

/// The template, built outside the source tree as by a user (CMakeLists.txt).
class MyClientTest : public InteropTest {
 protected:
  std::unique_ptr<Process> start_server(const Words& before = {}, const Words& further = {}) const {
    return start("sim_server",
                 Words{"--scenario", SLS_INTEROP_DIR "/my_client/my_client.yaml"} + further,
                 before);
  }
  std::unique_ptr<Process> start_client(const Words& before = {}) const {
    return std::make_unique<Process>(
        kOnLoopback + before + Words{SLS_INTEROP_DIR "/my_client/build/my_client", domain_.text()});
  }

  static constexpr std::size_t kLastStep = 5000;
};

/// Its memory, an integral, is part of states and answers: losses and a killed client change no
/// byte.
TEST_F(MyClientTest, BringsTheLoadToItsPointWithTheSameBytesDespiteLosses) {
  EXPECT_LE(count_rows(SLS_INTEROP_DIR "/my_client/my_client.c"), 240u) << "a template is short";
  const std::string undisturbed = recording_ + "-undisturbed";
  for (const bool is_disturbed : {false, true}) {
    const Words loss = is_disturbed ? lossy(5) : Words{};
    const auto recorder = start("recorder", {"--out", is_disturbed ? recording_ : undisturbed});
    const auto server = start_server(loss);
    auto client = start_client(loss);
    if (is_disturbed) {
      ASSERT_TRUE(wait_for_steps(100)) << server->output();
      client->kill();
      client = start_client(loss);
    }
    expect_success({server.get(), client.get(), recorder.get()});
    EXPECT_FALSE(holds(server->output(), "expected")) << server->output();  // no mistake
  }
  EXPECT_TRUE(read_manifest(recording_).at("complete").get<bool>());
  for (const char* file : {"state.csv", "reference.csv"})
    EXPECT_TRUE(read_file(recording_ + "/" + file) == read_file(undisturbed + "/" + file)) << file;
  const Table states(recording_ + "/state.csv");
  ASSERT_EQ(states.rows(), kLastStep + 1);
  EXPECT_LE((states.position(kLastStep, "load") - Eigen::Vector3d(1, -1, -2)).norm(), 0.05);
}

/// LIFESPAN would drop all its commands. Its repeated announcements show the clock.
TEST_F(MyClientTest, IsNamedAndFliesOnInRealTimeWhenItsClockIsSetBack) {
  if (find_faketime().empty()) GTEST_SKIP() << kNoFaketime;
  const std::filesystem::path clock = folder_ / "clock";
  std::ofstream(clock) << "+0s";
  const auto recorder = start_recorder();
  const auto server = start_server({}, {"--mode", "realtime"});
  const auto client =
      start_client(Words{"env"} + make_clock_words("FAKETIME_TIMESTAMP_FILE=" + clock.string()));
  ASSERT_TRUE(wait_for_steps(100)) << server->output();
  std::ofstream(clock.string() + ".new") << "-1s";
  std::filesystem::rename(clock.string() + ".new", clock);
  EXPECT_TRUE(wait_until([&] { return holds(server->output(), "s behind ours"); }))
      << server->output();
  EXPECT_TRUE(holds(server->output(), "the clock of controller 'my_client' on "))
      << server->output();
  expect_success({server.get(), client.get(), recorder.get()});
}

TEST_F(MyClientTest, FollowsAResetAndTheServerThatReplacesAKilledOne) {
  const auto recorder = start_recorder({"--follow"});
  auto server = start_server({}, kManySteps);
  const auto client = start_client();
  ASSERT_TRUE(wait_for_steps(100)) << server->output();
  client->send(SIGSTOP);  // holds the flight until sim_ctl has joined
  const auto reset = start("sim_ctl", {"reset"});
  ASSERT_EQ(reset->wait(), 0) << reset->output() << server->output();
  client->send(SIGCONT);
  ASSERT_TRUE(wait_until([&] { return count_rows(find_second_run() / "state.csv") > 100; }))
      << server->output() << client->output();
  ASSERT_TRUE(server->is_running()) << "over before the kill\n" << server->output();
  server->kill();
  server = start_server({}, kManySteps);
  expect_success({server.get(), client.get(), recorder.get()});
}

}  // namespace
}  // namespace sls::test
