/// A host on the network attacks a flight in many ways. The flight must finish with the bytes of an
/// undisturbed one, and the memory of the programs must stay bounded: README.md.
#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <map>
#include <memory>
#include <utility>

#include "tests/network/hosts_flight.hpp"

namespace sls::test {
namespace {

using namespace std::chrono_literals;

/// Independent attacks run at the same time.
class HostileTest : public HostsTest {
 protected:
  explicit HostileTest(const std::string& profile = "lan")
      : HostsTest({"server", "controller", "recorder", "attacker"}), profile_name_(profile) {}

  void SetUp() override {
    HostsTest::SetUp();
    if (IsSkipped()) return;
    profile_ = std::make_unique<Profile>(*network_, profile_name_);
    options_ = profile_->flight_options();
  }

  void TearDown() override {
    for (auto& attacker : attackers_) {
      attacker->send(SIGCONT);
      attacker->send(SIGTERM);
    }
    for (auto& attacker : attackers_) {
      EXPECT_EQ(attacker->wait(30s), 0) << attacker->output();
      std::printf("%s", attacker->output().c_str());
      const bool has_none = attacker->output().find(": 0\n") != std::string::npos;
      EXPECT_EQ(has_none, attacker.get() == deaf_) << "it has fired nothing, or heard something";
    }
  }

  Process& attack(const std::string& what, const Flight& flight,
                  const std::string& host = "attacker", const Words& more = {}) {
    attackers_.push_back(
        std::make_unique<Process>(network_->on(host) +
                                  Words{SLS_ATTACKER, what, "--to", network_->address("server"),
                                        "--domain", flight.domain.text()} +
                                  more));
    return *attackers_.back();
  }

  /// Captures the packets of a whole flight of the same programs in `file`.
  void capture(const std::filesystem::path& file) {
    Flight flight(scenario("short"), options_);
    Process& sniffer = attack("capture", flight, "server", {"--file", file});
    flight.expect_success();
    sniffer.send(SIGTERM);
    ASSERT_EQ(sniffer.wait(30s), 0);
  }

  /// Pauses the flight until all attacks are under way. Otherwise it could end before.
  void wait_until_all_fire(Flight& flight) {
    ASSERT_TRUE(flight.wait_for_steps(1)) << flight.outputs();
    flight.client->send(SIGSTOP);
    for (auto& attacker : attackers_)
      EXPECT_TRUE(wait_until([&] { return holds(attacker->output(), "fires"); }, 20s))
          << attacker->output() << flight.outputs();
    flight.client->send(SIGCONT);
  }

  /// Peak memory of a program, in MB; 0 if it has ended.
  static double find_peak_memory(const Process& program) {
    const std::string status = read_file("/proc/" + std::to_string(program.id()) + "/status");
    const auto at = status.find("VmHWM:");
    return at == std::string::npos ? 0 : std::atof(status.c_str() + at + 6) / 1024;
  }

  /// Waits for the end of an attacked flight and expects the result of a flight without attack.
  void expect_undisturbed(Flight& flight, double most_mb) {
    std::map<std::string, double> peaks;
    wait_until([&] {
      for (const auto& [name, program] :
           {std::pair("server", flight.server.get()), std::pair("client", flight.client.get()),
            std::pair("recorder", flight.recorder.get())})
        peaks[name] = std::max(peaks[name], find_peak_memory(*program));
      return !flight.server->is_running();
    });
    flight.expect_success();
    for (const auto& [name, peak] : peaks) {
      std::printf("peak memory of the %s: %.0f MB\n", name.c_str(), peak);
      EXPECT_LT(peak, most_mb) << name;
    }
    test::expect_undisturbed(flight.recording(), scenario("figure_eight"));
  }

  /// Expects that no program crashes or hangs. The flight itself may fail.
  static void expect_orderly_end(Flight& flight) {
    const auto processes = {flight.server.get(), flight.client.get(), flight.recorder.get()};
    wait_until([&] { return !flight.server->is_running(); }, 10s);
    for (Process* process : processes) process->send(SIGTERM);
    for (Process* process : processes) {
      const auto code = process->wait(30s);
      ASSERT_TRUE(code) << "hangs\n" << flight.outputs();
      EXPECT_TRUE(*code == 0 || *code == 1 || *code == 128 + SIGTERM) << *code << flight.outputs();
    }
  }

  // --- attacks on flights with and without keys ---

  /// Flies until SLS_MUTATIONS packets are fired, by default once. A participant may take 64 MB
  /// more than without them, and names their sender once.
  void expect_that_mutations_disturb_nothing() {
    const char* wanted = std::getenv("SLS_MUTATIONS");
    const std::uint64_t most = wanted ? std::stoull(wanted) : 1;
    for (std::uint64_t fired = 0, seed = 1; fired < most && !HasFailure(); ++seed) {
      const TemporaryFolder folder;
      Process sniffer(network_->on("server") +
                      Words{SLS_ATTACKER, "capture", "--file", folder / "packets"});
      Flight flight(scenario("figure_eight"), options_);
      ASSERT_TRUE(flight.wait_for_steps(1)) << flight.outputs();
      flight.client->send(SIGSTOP);
      sniffer.send(SIGTERM);
      ASSERT_EQ(sniffer.wait(30s), 0);
      Process& attacker = attack(
          "mutations", flight, "attacker",
          {"--to", network_->address("controller"), "--to", network_->address("recorder"), "--file",
           folder / "packets", "--most", "1000000", "--seed", std::to_string(seed)});
      wait_until_all_fire(flight);
      expect_undisturbed(flight, 55 + 64);
      attacker.send(SIGTERM);
      ASSERT_EQ(attacker.wait(30s), 0) << attacker.output();
      const std::string line = network_->address("attacker") + ": expected RTPS messages";
      for (const auto* program : {&flight.server, &flight.client, &flight.recorder}) {
        const std::string said = (*program)->output();
        EXPECT_EQ(said.find(line), said.rfind(line)) << said;
      }
      fired += std::stoull(attacker.output().substr(attacker.output().find(": ") + 2));
    }
  }

  /// The attacks send packets of an earlier flight. They begin during this flight: earlier, such
  /// packets simulate the programs of the earlier flight, or so many participants that the real
  /// ones cannot join, and this flight would not start.
  void expect_that_forgeries_disturb_nothing() {
    const TemporaryFolder folder;
    capture(folder / "packets");
    Flight flight(scenario("figure_eight"), options_);
    ASSERT_TRUE(flight.wait_for_steps(1)) << flight.outputs();
    for (const char* what : {"packets", "announcements"})
      attack(what, flight, "attacker", {"--file", folder / "packets"});
    expect_undisturbed(flight, 400);
  }

  // Packets forged in the sender's name can contain anything; only DDS Security prevents that. But
  // no program may crash or hang.
  void expect_that_spoofed_packets_crash_nobody() {
    Flight flight(scenario("figure_eight"), options_);
    attack("spoof", flight, "server");
    expect_orderly_end(flight);
  }

  FlightOptions options_;
  std::vector<std::unique_ptr<Process>> attackers_;
  const Process* deaf_ = nullptr;  ///< the attacker that must receive nothing

 private:
  const std::string profile_name_;
  std::unique_ptr<Profile> profile_;
};

TEST_F(HostileTest, MalformedPacketsAndThousandsOfInventedParticipantsDisturbNothing) {
  expect_that_forgeries_disturb_nothing();
}

TEST_F(HostileTest, ChangedPacketsOfEveryKindDisturbNothing) {
  expect_that_mutations_disturb_nothing();
}

TEST_F(HostileTest, ParticipantsThatComeAndGoDisturbNothing) {
  Flight flight(scenario("figure_eight"), options_);
  attack("come-and-go", flight);
  wait_until_all_fire(flight);
  expect_undisturbed(flight, 400);
}

TEST_F(HostileTest, InvalidSamplesDisturbNothing) {
  Flight flight(scenario("figure_eight"), options_);
  attack("malformed", flight);
  attack("control", flight);
  Process& deaf = attack("readers", flight);
  wait_until_all_fire(flight);
  deaf.send(SIGSTOP);  // no longer acknowledges
  expect_undisturbed(flight, 400);
}

TEST_F(HostileTest, FalseSamplesAboutTheFlightAreIgnored) {
  Flight flight(scenario("figure_eight"), options_);
  attack("commands", flight);
  attack("statements", flight);
  wait_until_all_fire(flight);
  expect_undisturbed(flight, 400);
}

TEST_F(HostileTest, AStrongerControllerThatIsOfNoUseIsPassedOver) {
  Flight flight(scenario("figure_eight"), options_);
  attack("silent-controller", flight);
  attack("mad-controller", flight);
  wait_until_all_fire(flight);
  expect_undisturbed(flight, 400);
}

TEST_F(HostileTest, PacketsSpoofedInTheFlightsNameCrashNoProgram) {
  expect_that_spoofed_packets_crash_nobody();
}

// --- the same against a flight with keys, by attackers without keys ------------------------------

class SecuredHostileTest : public HostileTest {
 protected:
  SecuredHostileTest() : HostileTest("secure") {}
};

TEST_F(SecuredHostileTest, MalformedPacketsAndThousandsOfInventedParticipantsDisturbNothing) {
  expect_that_forgeries_disturb_nothing();
}

TEST_F(SecuredHostileTest, ChangedPacketsOfEveryKindDisturbNothing) {
  expect_that_mutations_disturb_nothing();
}

TEST_F(SecuredHostileTest, AProgramWithoutKeysDisturbsNothingAndReadsNothing) {
  Flight flight(scenario("figure_eight"), options_);
  attack("malformed", flight);
  deaf_ = &attack("readers", flight);
  wait_until_all_fire(flight);
  expect_undisturbed(flight, 400);
}

TEST_F(SecuredHostileTest, PacketsSpoofedInTheFlightsNameCrashNoProgram) {
  expect_that_spoofed_packets_crash_nobody();
}

}  // namespace
}  // namespace sls::test
