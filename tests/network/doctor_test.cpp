/// Real causes on separate hosts: the doctor reports each, and nothing else.
#include <gtest/gtest.h>

#include <chrono>
#include <set>
#include <sstream>

#include "tests/network/hosts_flight.hpp"
#include "tests/support/faketime.hpp"

namespace sls::test {
namespace {

/// Longest time of a doctor. On an idle machine it is 10 s at most; this one may be busy.
constexpr auto kMostTime = std::chrono::seconds(20);

/// The output of a doctor.
struct Report {
  int code = -1;
  std::string text;
  std::set<std::string> findings;

  /// The line about `check`; empty if there is none.
  std::string line(const std::string& check) const {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
      if (line.rfind(check + " ", 0) == 0) return line;
    return {};
  }
};

Report examine(const Words& command) {
  const auto began = std::chrono::steady_clock::now();
  Process doctor(command);
  Report found;
  found.code = doctor.wait().value_or(-1);
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - began;
  EXPECT_LT(time, kMostTime) << time.count() << " s";
  found.text = doctor.output();
  constexpr std::size_t kNameWidth = 14;
  std::istringstream lines(found.text);
  for (std::string line; std::getline(lines, line);) {
    if (line.size() < kNameWidth || line.compare(kNameWidth, 6, "FAULT ") != 0) continue;
    found.findings.insert(line.substr(0, line.find_last_not_of(' ', kNameWidth - 1) + 1));
  }
  return found;
}

void expect_healthy(const Report& found) {
  EXPECT_EQ(found.code, 0) << found.text;
  EXPECT_TRUE(found.findings.empty()) << found.text;
}

/// Expects exactly `findings`. The first is the cause, and its line contains `words`.
void expect_findings(const Report& found, const Words& findings, const std::string& words) {
  EXPECT_EQ(found.code, 1) << found.text;
  EXPECT_EQ(found.findings, std::set<std::string>(findings.begin(), findings.end())) << found.text;
  EXPECT_NE(found.line(findings.front()).find(words), std::string::npos) << found.text;
}

/// Two hosts, `here` and `there`. Their /dev/shm is a folder of the test.
class DoctorTest : public HostsTest {
 protected:
  DoctorTest() : HostsTest({"here", "there"}) {
    std::filesystem::permissions(memory_.path(), std::filesystem::perms(01777));
  }

  /// Prefix that runs a command on `host` with another /dev/shm, which the command `mount` mounts.
  Words with_memory(const std::string& host, const std::string& mount) const {
    return network_->on(host) +
           Words{"unshare", "--mount", "sh", "-c", mount + " /dev/shm && exec \"$0\" \"$@\""};
  }
  Words on(const std::string& host) const {
    return with_memory(host, "mount --bind " + memory_.path().string());
  }
  static Words doctor(const std::string& profile, const Words& flags = {}) {
    return Words{program("sls_doctor"), "--qos", qos(profile)} + flags;
  }
  Words with_peer(const Words& flags = {}) const {
    return Words{"--peer", network_->address("there")} + flags;
  }
  Report examine_there(const std::string& profile = "lan") const {
    return examine(on("here") + doctor(profile, with_peer()));
  }

  /// Starts a server, which waits for others for 30 s.
  std::unique_ptr<Process> start_server(const Words& before, const std::string& qos_file,
                                        int domain = 0) const {
    auto server = std::make_unique<Process>(
        before + make_command("sim_server", domain, {"--scenario", scenario("short")}, qos_file));
    EXPECT_TRUE(wait_until(
        [&] { return holds(server->output(), "waiting for") || !server->is_running(); }));
    return server;
  }
  std::unique_ptr<Process> start_answerer(const std::string& host, const Words& before = {}) const {
    auto answerer = std::make_unique<Process>(on(host) + before + doctor("lan", {"--answer"}));
    EXPECT_TRUE(wait_until([&] { return !answerer->output().empty(); }));
    return answerer;
  }

  TemporaryFolder memory_;
};

// --- no finding ----------------------------------------------------------------------------------

class HealthyDoctorTest : public DoctorTest, public testing::WithParamInterface<const char*> {};

TEST_P(HealthyDoctorTest, FindsNoFaultOnAnIdleMachineOrDuringAFlight) {
  expect_healthy(examine(on("there") + doctor(GetParam())));
  FlightOptions options;
  options.qos_file = qos(GetParam());
  options.server = {"--mode", "realtime"};  // makes the flight last longer
  for (const char* name : {"recorder", "sim_server", "control_client"})
    options.before[name] = on("there");
  const Flight flight(scenario("figure_eight"), options);
  ASSERT_TRUE(flight.wait_for_steps(1)) << flight.outputs();
  const Words domain = {"--domain", flight.domain.text()};
  const Report found = examine(on("there") + doctor(GetParam(), domain));
  expect_healthy(found);
  for (const char* name : {"sim_server", "control_client", "recorder"})
    EXPECT_TRUE(holds(found.line("data"), name)) << found.text;
  if (GetParam() == std::string("lan"))
    expect_healthy(examine(on("here") + doctor("lan", with_peer(domain))));
}

INSTANTIATE_TEST_SUITE_P(Profiles, HealthyDoctorTest, testing::Values("default", "udp", "lan"));

TEST_F(DoctorTest, BetweenTwoHealthyHostsSamplesAndDatagramsOfEverySizePass) {
  const auto answerer = start_answerer("there");
  const Report found = examine_there();
  expect_healthy(found);
  EXPECT_TRUE(holds(found.line("datagrams"), "60000 bytes pass")) << found.text;
  EXPECT_TRUE(holds(found.line("data"), "a doctor at 10.77.0.2")) << found.text;
}

// --- the network ---------------------------------------------------------------------------------

TEST_F(DoctorTest, NamesASwitchWithoutMulticast) {
  const auto answerer = start_answerer("there");
  network_->block_multicast();
  expect_findings(examine_there(), {"multicast"}, "nothing sent to 239.255.0.1:7400 came back");
}

TEST_F(DoctorTest, NamesPortsThatAreBlockedThere) {
  const auto server = start_server(on("there"), qos("lan"));
  network_->run("there",
                "nft 'add table ip f; add chain ip f i { type filter hook input priority 0; }; "
                "add rule ip f i udp dport 7401-7649 drop'");
  const Report found = examine_there();
  EXPECT_EQ(found.findings.count("ports"), 1u) << found.text;
  EXPECT_EQ(found.findings.count("multicast"), 0u) << found.text;
  EXPECT_NE(found.line("ports").find("UDP 7410 to 7429 of 10.77.0.2 are blocked"),
            std::string::npos)
      << found.text;
}

TEST_F(DoctorTest, NamesPortsThatAreBlockedHere) {
  const auto answerer = start_answerer("there");
  network_->run("here",
                "nft 'add table ip f; add chain ip f i { type filter hook input priority 0; }; "
                "add rule ip f i ct state established accept; "
                "add rule ip f i udp dport 7401-7649 drop'");
  expect_findings(examine_there(), {"ports", "data"}, "of this machine are blocked");
}

TEST_F(DoctorTest, NamesLostFragmentsWithAndWithoutADoctorThere) {
  network_->run(
      "there",
      "nft 'add table ip f; add chain ip f i { type filter hook prerouting priority -450; "
      "}; add rule ip f i ip frag-off & 0x1fff != 0 drop'");
  const auto server = start_server(on("there"), qos("lan"));
  const std::string words = "8000 and 60000 bytes do not pass, 1400 do";
  const Report without = examine_there();
  EXPECT_TRUE(holds(without.line("datagrams"), words)) << without.text;
  const auto answerer = start_answerer("there");
  expect_findings(examine_there(), {"datagrams", "data"}, words);
}

TEST_F(DoctorTest, NamesAProfileThatStaysOnItsMachine) {
  const Report found = examine_there("udp");
  expect_findings(found, {"network"}, "udp.xml stays on 127.0.0.1");
}

TEST_F(DoctorTest, NamesADiscoveryServerThatIsNotThere) {
  const Words environment = {"env", "SLS_DISCOVERY_SERVER=" + network_->address("there")};
  expect_findings(examine(on("here") + environment + doctor("discovery_server")),
                  {"discovery", "data"}, "no discovery server answers at 10.77.0.2:11811");
}

TEST_F(DoctorTest, NamesAClockThatIsAnHourOff) {
  if (find_faketime().empty()) GTEST_SKIP() << kNoFaketime;
  const auto answerer = start_answerer("there", Words{"env"} + make_clock_words("FAKETIME=+3600s"));
  expect_findings(examine_there(), {"clock"}, "3.6e+03 s ahead");
}

// --- the machine ---------------------------------------------------------------------------------

TEST_F(DoctorTest, NamesASharedMemoryThatIsTooSmallAndSurvivesIt) {
  expect_findings(
      examine(with_memory("here", "mount -t tmpfs -o size=1M tmpfs") + doctor("default")),
      {"shared memory"}, "/dev/shm has 1.0 MB free of 1.0 MB");
}

TEST_F(DoctorTest, NamesASharedMemoryThatIsNotShared) {
  const auto server = start_server(with_memory("here", "mount -t tmpfs tmpfs"), qos("default"));
  expect_findings(examine(on("here") + doctor("default")), {"shared memory", "data"},
                  "sim_server runs on this host with another /dev/shm");
}

TEST_F(DoctorTest, NamesSegmentsThatAKilledProcessLeft) {
  start_server(on("here"), qos("default"))->send(SIGKILL);
  // The doctor ignores young segments, because a starting process has such a segment as well.
  ASSERT_TRUE(wait_until([&] {
    for (const auto& file : std::filesystem::directory_iterator(memory_.path()))
      std::filesystem::last_write_time(
          file, std::filesystem::file_time_type::clock::now() - std::chrono::minutes(1));
    return !std::filesystem::is_empty(memory_.path());
  }));
  expect_findings(examine(on("here") + doctor("default")), {"shared memory"}, "3 stale segments");
}

TEST_F(DoctorTest, NamesAProgramOfAnotherUser) {
  const auto server = start_server(
      on("here") + Words{"setpriv", "--reuid", "65534", "--clear-groups"}, qos("default"));
  if (!server->is_running()) GTEST_SKIP() << "nobody cannot run it: " << server->output();
  expect_findings(examine(on("here") + doctor("default")), {"users", "data"},
                  "sim_server as nobody and the doctor as root");
}

// --- the domain ----------------------------------------------------------------------------------

TEST_F(DoctorTest, NamesTheDomainWhereTheOthersAre) {
  const auto server = start_server(on("here"), qos("default"), 5);
  expect_findings(examine(on("here") + doctor("default")), {"domain"},
                  "sim_server is on domain 5, and no program is on domain 0");
}

TEST_F(DoctorTest, NamesTheTopicAndThePolicyOfAQosMismatch) {
  TemporaryFolder folder;
  const std::string file = folder / "best_effort.xml";
  const std::string end = "  </profiles>\n</dds>";
  write_bytes(file, replace_once(read_file(qos("default")), end,
                                 R"(<data_writer profile_name="sls_latched_writer"><qos>
      <reliability><kind>BEST_EFFORT</kind></reliability></qos></data_writer>
)" + end));
  const auto server = start_server(on("here"), file);
  const Report found = examine(on("here") + doctor("default"));
  expect_findings(found, {"qos"},
                  "sls/status: RELIABILITY: offered best effort, asked reliable (sim_server");
}

TEST_F(DoctorTest, NamesATypeThatIsNotOurs) {
  Process stranger(on("here") + Words{std::string(SLS_STRANGER), qos("default"), "0"});
  ASSERT_TRUE(wait_until([&] { return !stranger.output().empty(); }));
  expect_findings(examine(on("here") + doctor("default")), {"types"},
                  "sls/state: stranger has type sls::SimStatus");
}

TEST_F(DoctorTest, NamesAnIdentityOfAnotherAuthority) {
  TemporaryFolder folder;
  for (const char* name : {"ours", "theirs"}) {
    Process keys({std::string(SLS_SOURCE_DIR) + "/config/security/keys.sh", folder / name});
    ASSERT_EQ(keys.wait(), 0) << keys.output();
  }
  const auto keys = [&](const char* name) {
    return Words{"env", "SLS_KEYS=" + (folder / name).string()};
  };
  const auto server = start_server(on("here") + keys("theirs"), qos("secure"));
  expect_healthy(examine(on("here") + keys("theirs") + doctor("secure")));
  expect_findings(examine(on("here") + keys("ours") + doctor("secure")), {"security"},
                  "reject each other");
  expect_findings(examine(on("here") + doctor("lan")), {"security"}, "with security");
}

// --- usage ---------------------------------------------------------------------------------------

TEST_F(DoctorTest, AWrongQosFileIsBadUsage) {
  const Report found = examine(on("here") + Words{program("sls_doctor"), "--qos", "/no/such.xml"});
  EXPECT_EQ(found.code, 2) << found.text;
}

}  // namespace
}  // namespace sls::test
