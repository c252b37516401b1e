/// A neighbour on the network attacks a flight with all it has. The flight must finish with the
/// bytes of an undisturbed one, and the server's memory must stay bounded: README.md.
#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <memory>

#include "tests/network/network.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

using namespace std::chrono_literals;

/// Attacks that have nothing to do with each other run side by side.
class HostileTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto obstacle = Network::find_obstacle()) GTEST_SKIP() << *obstacle;
    network_ = std::make_unique<Network>(
        std::vector<std::string>{"server", "controller", "recorder", "attacker"});
    FlightOptions options;
    options.qos_file = qos("lan");
    options.before["sim_server"] = network_->on("server");
    options.before["control_client"] = network_->on("controller");
    options.before["recorder"] = network_->on("recorder");
    options_ = options;
  }

  void TearDown() override {
    for (auto& attacker : attackers_) {
      attacker->send(SIGCONT);
      attacker->send(SIGTERM);
    }
    for (auto& attacker : attackers_) {
      EXPECT_EQ(attacker->wait(30s), 0) << attacker->output();
      EXPECT_EQ(attacker->output().find(": 0\n"), std::string::npos) << "it has fired nothing";
      std::printf("%s", attacker->output().c_str());
    }
  }

  Process& attack(const std::string& what, const Flight& flight,
                  const std::string& host = "attacker", std::vector<std::string> more = {}) {
    std::vector<std::string> command = network_->on(host);
    command.insert(command.end(), {SLS_ATTACKER, what, "--to", network_->address("server"),
                                   "--domain", flight.domain.text()});
    command.insert(command.end(), more.begin(), more.end());
    attackers_.push_back(std::make_unique<Process>(command));
    return *attackers_.back();
  }

  /// Packets of a whole flight of the same programs, in `file`.
  void capture(const std::filesystem::path& file) {
    Flight flight(scenario("short"), options_);
    Process& sniffer = attack("capture", flight, "server", {"--file", file});
    flight.expect_success();
    sniffer.send(SIGTERM);
    ASSERT_EQ(sniffer.wait(30s), 0);
  }

  /// The most memory the server has had, in MB; 0 where it has ended.
  static double find_peak_memory(const Process& server) {
    const std::string status = read_file("/proc/" + std::to_string(server.id()) + "/status");
    const auto at = status.find("VmHWM:");
    return at == std::string::npos ? 0 : std::atof(status.c_str() + at + 6) / 1024;
  }

  /// Waits for the end of an attacked flight, which is as if there had been no attack.
  void expect_undisturbed(Flight& flight, double most_mb) {
    double peak = 0;
    wait_until([&] {
      peak = std::max(peak, find_peak_memory(*flight.server));
      return !flight.server->is_running();
    });
    flight.expect_success();
    std::printf("peak memory of the server: %.0f MB\n", peak);
    EXPECT_LT(peak, most_mb);
    Flight undisturbed(scenario("figure_eight"));
    undisturbed.expect_success();
    for (const char* file : {"state.csv", "reference.csv"})
      EXPECT_TRUE(read_file(flight.recording() / file) == read_file(undisturbed.recording() / file))
          << file;
  }

  std::unique_ptr<Network> network_;
  FlightOptions options_;
  std::vector<std::unique_ptr<Process>> attackers_;
};

TEST_F(HostileTest, PacketsThatNoFriendSendsDisturbNothing) {
  const TemporaryFolder folder;
  capture(folder / "packets");
  Flight flight(scenario("figure_eight"), options_);
  attack("packets", flight, "attacker", {"--file", folder / "packets"});
  expect_undisturbed(flight, 400);
}

TEST_F(HostileTest, AnnouncementsOfThousandsThatDoNotExistDisturbNothing) {
  const TemporaryFolder folder;
  capture(folder / "packets");
  Flight flight(scenario("figure_eight"), options_);
  ASSERT_TRUE(flight.wait_for_steps(1)) << flight.outputs();  // before, they keep friends out
  attack("announcements", flight, "attacker", {"--file", folder / "packets"});
  expect_undisturbed(flight, 400);
}

TEST_F(HostileTest, ParticipantsThatComeAndGoDisturbNothing) {
  Flight flight(scenario("figure_eight"), options_);
  attack("come-and-go", flight);
  expect_undisturbed(flight, 400);
}

TEST_F(HostileTest, SamplesThatNoFriendWritesDisturbNothing) {
  Flight flight(scenario("figure_eight"), options_);
  attack("malformed", flight);
  attack("control", flight);
  Process& deaf = attack("readers", flight);
  ASSERT_TRUE(flight.wait_for_steps(100)) << flight.outputs();
  deaf.send(SIGSTOP);  // acknowledges nothing any more
  expect_undisturbed(flight, 400);
}

TEST_F(HostileTest, LiesAboutTheFlightAreNotBelieved) {
  Flight flight(scenario("figure_eight"), options_);
  attack("commands", flight);
  attack("statements", flight);
  expect_undisturbed(flight, 400);
}

TEST_F(HostileTest, AStrongerControllerThatIsOfNoUseIsPassedOver) {
  Flight flight(scenario("figure_eight"), options_);
  attack("silent-controller", flight);
  attack("mad-controller", flight);
  expect_undisturbed(flight, 400);
}

// Who forges packets under the sender's name can say anything; only security prevents that. But
// nobody may crash or hang over it.
TEST_F(HostileTest, SpoofedPacketsOfTheFlightItselfCrashNobody) {
  Flight flight(scenario("figure_eight"), options_);
  attack("spoof", flight, "server");
  const auto processes = {flight.server.get(), flight.client.get(), flight.recorder.get()};
  wait_until([&] { return !flight.server->is_running(); }, 10s);
  for (Process* process : processes) process->send(SIGTERM);
  for (Process* process : processes) {
    const auto code = process->wait(30s);
    ASSERT_TRUE(code) << "hangs\n" << flight.outputs();
    EXPECT_TRUE(*code == 0 || *code == 1 || *code == 128 + SIGTERM) << *code << flight.outputs();
  }
}

}  // namespace
}  // namespace sls::test
