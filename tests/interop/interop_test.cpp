/// Another vendor's DDS: examples/my_client, built outside the source tree as by a user
/// (CMakeLists.txt), and a recorder on Eclipse Cyclone DDS fly and record with the programs of this
/// project.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <fstream>

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

std::size_t count_rows(const std::filesystem::path& file) {
  const std::string text = read_file(file);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// Expects that the cyclone_recorder wrote the same bytes as the project's recorder.
void expect_same_rows(const std::filesystem::path& rows, const std::filesystem::path& ours,
                      std::uint64_t last_step) {
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
    write_scenario("");
  }

  /// The scenario of examples/my_client with further keys of `sync`, and other lines.
  void write_scenario(const std::string& sync, const std::string& more = "") const {
    write_bytes(scenario_, read_file(SLS_INTEROP_DIR "/my_client/my_client.yaml") +
                               "sync: { wait_for: { timeout_s: 60" + sync + " } }\n" + more);
  }

  /// One of the project's programs, over UDP on loopback; its command line follows `before`.
  std::unique_ptr<Process> start(const std::string& name, const Words& flags,
                                 const Words& before = {}) const {
    return std::make_unique<Process>(before + make_command(name, domain_.number(), kUdp + flags));
  }
  std::unique_ptr<Process> start_recorder(const Words& further = {}) const {
    return start("recorder", Words{"--out", recording_} + further);
  }
  std::unique_ptr<Process> start_server(const Words& further = {}, const Words& before = {}) const {
    return start("sim_server", Words{"--scenario", scenario_} + further, before);
  }
  std::unique_ptr<Process> start_client(const Words& before = {}) const {
    return std::make_unique<Process>(kOnLoopback + before + Words{kClient, domain_.text()});
  }
  std::unique_ptr<Process> start_cyclone_recorder() const {
    return std::make_unique<Process>(
        kOnLoopback + Words{SLS_INTEROP_DIR "/cyclone_recorder", domain_.text(), rows_});
  }
  bool wait_for_steps(std::size_t steps) const {
    return wait_until([&] { return count_rows(recording_ + "/state.csv") > steps; });
  }

  /// The subfolder of the recording with the last run.
  std::filesystem::path find_last_run() const {
    std::filesystem::path last;
    for (const auto& entry : std::filesystem::directory_iterator(recording_))
      if (entry.is_directory() && (last.empty() || last_write_time(entry) > last_write_time(last)))
        last = entry;
    return last;
  }

  void expect_at_its_point(std::size_t last_step) const {
    const Table states(recording_ + "/state.csv");
    ASSERT_EQ(states.rows(), last_step + 1);
    EXPECT_LE((states.position(last_step, "load") - Eigen::Vector3d(1, -1, -2)).norm(), 0.05);
  }

  static constexpr const char* kClient = SLS_INTEROP_DIR "/my_client/build/my_client";
  static constexpr std::size_t kLastStep = 5000, kLastOfMany = 20000;  // with kManySteps
  TemporaryFolder folder_;
  OwnDomain domain_;
  const std::string scenario_ = folder_ / "scenario.yaml";
  const std::string recording_ = folder_ / "recording";
  const std::string rows_ = folder_ / "rows";  // of the cyclone_recorder
};

/// Its memory, an integral, is part of states and answers: losses and a killed client change no
/// byte.
TEST_F(InteropTest, MyClientBringsTheLoadToItsPointWithTheSameBytesDespiteLosses) {
  EXPECT_LE(count_rows(SLS_INTEROP_DIR "/my_client/my_client.c"), 240u) << "a template is short";
  const std::string undisturbed = recording_ + "-undisturbed";
  for (const bool is_disturbed : {false, true}) {
    const Words loss = is_disturbed ? lossy(5) : Words{};
    const auto recorder = start("recorder", {"--out", is_disturbed ? recording_ : undisturbed});
    const auto server = start_server({}, loss);
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
  expect_at_its_point(kLastStep);
}

/// Seventy vehicles: two samples per step.
TEST_F(InteropTest, MyClientFliesAFleetAndACycloneRecorderWritesTheSameRows) {
  write_scenario(", recorders: 2", "vehicles: 70\n");
  const auto recorder = start_recorder(), server = start_server({"--period-s", "0.02"});
  const auto cyclone_recorder = start_cyclone_recorder(), client = start_client();
  expect_success({server.get(), client.get(), recorder.get(), cyclone_recorder.get()});
  EXPECT_FALSE(holds(server->output(), "expected")) << server->output();  // no mistake
  EXPECT_TRUE(read_manifest(recording_).at("complete").get<bool>());
  EXPECT_EQ(count_rows(recording_ + "/state.csv"), 1 + 70 * 1001u);
  expect_same_rows(rows_, recording_, 1000);
}

TEST_F(InteropTest, MyClientTakesOverFromAControllerThatIsKilled) {
  write_scenario(", controllers: 2");
  const auto recorder = start_recorder(), server = start_server(kManySteps);
  const auto primary =
      start("control_client", {"--scenario", scenario_, "--strength", "1", "--name", "primary"});
  const auto standby = start_client();
  ASSERT_TRUE(wait_for_steps(100)) << server->output();
  primary->kill();
  expect_success({server.get(), standby.get(), recorder.get()});
  EXPECT_TRUE(read_manifest(recording_).at("complete").get<bool>());
  const Table commands(recording_ + "/command.csv");
  EXPECT_EQ(commands.text(0, "controller"), "primary");
  EXPECT_EQ(commands.text(kLastOfMany, "controller"), "my_client");
  expect_at_its_point(kLastOfMany);
}

TEST_F(InteropTest, MyClientAndRecorderFollowAResetAndTheServerThatReplacesAKilledOne) {
  const auto recorder = start_recorder({"--follow"});
  auto server = start_server(kManySteps);
  const auto client = start_client(), cyclone_recorder = start_cyclone_recorder();
  ASSERT_TRUE(wait_for_steps(100)) << server->output();
  client->send(SIGSTOP);  // holds the flight until sim_ctl has joined
  const auto reset = start("sim_ctl", {"reset"});
  ASSERT_EQ(reset->wait(), 0) << reset->output() << server->output();
  client->send(SIGCONT);
  ASSERT_TRUE(wait_until([&] { return count_rows(find_last_run() / "state.csv") > 100; }))
      << server->output() << client->output();
  ASSERT_TRUE(server->is_running()) << "over before the kill\n" << server->output();
  server->kill();
  server = start_server(kManySteps);
  expect_success({server.get(), client.get(), recorder.get(), cyclone_recorder.get()});
  expect_same_rows(rows_, find_last_run(), kLastOfMany);
}

TEST_F(InteropTest, ALateCycloneRecorderGetsTheMissedSamples) {
  const auto recorder = start_recorder();
  const auto server = start_server(kManySteps), client = start_client();
  ASSERT_TRUE(wait_for_steps(100)) << server->output();
  client->send(SIGSTOP);  // the flight pauses until the late recorder has joined
  const auto late_recorder = start_cyclone_recorder();
  EXPECT_TRUE(wait_for_text(*late_recorder, " run "));
  client->send(SIGCONT);
  expect_success({server.get(), client.get(), recorder.get(), late_recorder.get()});
  expect_same_rows(rows_, recording_, kLastOfMany);
}

/// LIFESPAN would drop all its commands. Its repeated announcements show the clock.
TEST_F(InteropTest, MyClientIsNamedAndFliesOnInRealTimeWhenItsClockIsSetBack) {
  if (find_faketime().empty()) GTEST_SKIP() << kNoFaketime;
  const std::filesystem::path clock = folder_ / "clock";
  std::ofstream(clock) << "+0s";
  const auto recorder = start_recorder();
  const auto server = start_server({"--mode", "realtime", "--rtf", "2"});
  const auto client =
      start_client(Words{"env"} + make_clock_words("FAKETIME_TIMESTAMP_FILE=" + clock.string()));
  ASSERT_TRUE(wait_for_steps(100)) << server->output();
  std::ofstream(clock.string() + ".new") << "-1s";
  std::filesystem::rename(clock.string() + ".new", clock);
  EXPECT_TRUE(wait_for_text(*server, "s behind ours")) << server->output();
  EXPECT_TRUE(holds(server->output(), "the clock of controller 'my_client' on "))
      << server->output();
  expect_success({server.get(), client.get(), recorder.get()});
}

/// On a secured domain.
class SecuredInteropTest : public InteropTest {
 protected:
  void SetUp() override {
    InteropTest::SetUp();
    if (!IsSkipped() && !std::filesystem::exists(SLS_CYCLONE_PLUGINS "/libdds_security_crypto.so"))
      GTEST_SKIP() << "expected Cyclone's security plugins in " SLS_CYCLONE_PLUGINS;
    if (std::string(SLS_FASTDDS_RELEASE).rfind("2.11.", 0) == 0)
      GTEST_SKIP() << "Fast DDS 2.11 and Cyclone DDS 0.10 end no handshake (docs/limits.md)";
  }
  void make_keys(const Words& flags) const {
    Process process(Words{SLS_SOURCE_DIR "/sls", "keys", keys_} + flags);
    ASSERT_EQ(process.wait(), 0) << process.output();
  }
  Process start_secured(const std::string& name, const Words& flags) const {
    return Process(with_keys_ + make_command(name, domain_.number(), flags, qos("secure")));
  }
  Process start_secured_client() const {
    return Process(with_keys_ + Words{"SLS_IDENTITY=controller",
                                      "SLS_CYCLONE_PLUGINS=" SLS_CYCLONE_PLUGINS,
                                      "CYCLONEDDS_URI=file://" SLS_SOURCE_DIR
                                      "/tests/interop/cyclone_secure.xml",
                                      kClient, domain_.text()});
  }

  const std::string keys_ = folder_ / "keys";
  const Words with_keys_ = {"env", "SLS_KEYS=" + keys_};
};

TEST_F(SecuredInteropTest, MyClientFliesWithKeysForOtherVendors) {
  make_keys({"--other-vendors"});
  Process recorder = start_secured("recorder", {"--out", recording_});
  Process server = start_secured("sim_server", {"--scenario", scenario_});
  Process client = start_secured_client();
  expect_success({&server, &client, &recorder});
  EXPECT_TRUE(read_manifest(recording_).at("complete").get<bool>());
  EXPECT_FALSE(holds(server.output(), "expected")) << server.output();  // no mistake
}

TEST_F(SecuredInteropTest, MyClientWithOtherKeysIsNamedWithTheReason) {
  make_keys({});
  Process server = start_secured("sim_server", {"--scenario", scenario_});
  Process client = start_secured_client();
  const std::string who = SLS_FASTDDS_VERSION > 2 ? "refused 'my_client' (" : "'my_client' (";
  EXPECT_TRUE(wait_until([&] {
    return holds(server.output(),
                 "): another vendor's DDS: expected keys of ./sls keys DIR --other-vendors, got "
                 "keys without it\n");
  })) << server.output();
  EXPECT_TRUE(holds(server.output(), "warning: " + who)) << server.output();
  EXPECT_FALSE(holds(server.output(), "expected an announcement")) << server.output();
}

/// The client on a host of its own, with Cyclone as the user configures it.
class InteropHostsTest : public InteropTest {
 protected:
  void SetUp() override {
    InteropTest::SetUp();
    if (IsSkipped()) return;
    if (const auto obstacle = Network::find_obstacle()) GTEST_SKIP() << *obstacle;
    network_ = std::make_unique<Network>(kHosts);
  }
  /// Expects success. The project's programs use `profile`.
  void expect_flight(const std::string& profile, const Words& configuration) const {
    const Profile configured(*network_, profile);
    const Programs programs(configured.flight_options());
    const auto recorder = programs.start("recorder", {"--out", recording_}),
               server = programs.start("sim_server", {"--scenario", scenario_});
    Process client(network_->on("controller") + configuration +
                   Words{kClient, programs.domain.text()});
    expect_success({server.get(), &client, recorder.get()});
    EXPECT_TRUE(read_manifest(recording_).at("complete").get<bool>());
  }

  std::unique_ptr<Network> network_;
};

/// Without a configuration Cyclone uses the host's network, as profile `lan` does.
TEST_F(InteropHostsTest, MyClientFliesWithProfileLan) { expect_flight("lan", {}); }

TEST_F(InteropHostsTest, MyClientFliesWithProfileUnicast) {
  network_->block_multicast();
  std::string peers;
  for (const char* host : {"server", "recorder"})
    peers += "<Peer address=\"" + network_->address(host) + "\"/>";
  expect_flight(
      "unicast",
      {"env",
       "CYCLONEDDS_URI=<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast>"
       "</General><Discovery><ParticipantIndex>auto</ParticipantIndex><Peers>" +
           peers + "</Peers></Discovery></Domain></CycloneDDS>"});
}

}  // namespace
}  // namespace sls::test
