#include "tools/doctor/diagnosis.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace sls::doctor {
namespace {

/// A healthy network: a doctor and a server on another host.
Observations make_healthy() {
  Observations seen;
  seen.qos_file = "lan.xml";
  seen.user = "root";
  seen.peer = "desk";
  seen.peer_address = "10.0.0.2";
  seen.is_peer_here = false;
  seen.settings.uses_multicast = true;
  seen.probes.is_tried = seen.probes.is_answered = seen.probes.is_answered_unasked = true;
  seen.probes.is_multicast_answered = true;
  seen.probes.sizes = {{1400, true}, {8000, true}};
  seen.probes.clock_ahead = std::chrono::milliseconds(2);
  seen.is_joined = true;
  Program server;
  server.name = "sim_server";
  server.address = seen.peer_address;
  server.is_expected = true;
  server.samples = 3;
  seen.programs = {server};
  seen.echoes = {{200, true}};
  return seen;
}

Observations make_healthy_with_shared_memory() {
  Observations seen = make_healthy();
  seen.settings.uses_shared_memory = true;
  seen.settings.segment_size = 4'000'000;
  seen.shared_memory.is_there = true;
  seen.shared_memory.size = seen.shared_memory.free = 64'000'000;
  seen.shared_memory.read_ports = {7411};
  seen.programs.front().is_on_this_host = true;
  seen.programs.front().user = "root";
  seen.programs.front().shared_memory_ports = {7411};
  return seen;
}

std::vector<std::string> list_findings(const Observations& seen) {
  std::vector<std::string> names;
  for (const Check& check : diagnose(seen))
    if (check.verdict == Verdict::kFinding) names.push_back(check.name);
  return names;
}

using Names = std::vector<std::string>;

TEST(DiagnosisTest, OfAHealthyNetworkFindsNothing) {
  EXPECT_EQ(list_findings(make_healthy()), Names{});
  EXPECT_EQ(list_findings(make_healthy_with_shared_memory()), Names{});
}

TEST(DiagnosisTest, MulticastIsReportedOnlyWhereUnicastWorks) {
  Observations seen = make_healthy();
  seen.probes.is_multicast_answered = false;
  EXPECT_EQ(list_findings(seen), Names{"multicast"});
  seen.settings.uses_multicast = false;
  EXPECT_EQ(list_findings(seen), Names{});
}

TEST(DiagnosisTest, PortsAreReportedOnlyWhereTheHostIsUpAndNoDataPasses) {
  Observations seen = make_healthy();
  seen.settings.uses_multicast = false;
  seen.probes = {};
  seen.probes.is_tried = true;
  EXPECT_EQ(list_findings(seen), Names{}) << "samples pass";
  seen.programs.clear();
  seen.echoes.clear();
  seen.is_peer_up = true;
  EXPECT_EQ(list_findings(seen), Names{"ports"});
  seen.is_peer_up = false;
  EXPECT_EQ(list_findings(seen), Names{"network"});
}

TEST(DiagnosisTest, AClockIsWrongFromATenthOfASecondOn) {
  Observations seen = make_healthy();
  seen.probes.clock_ahead = std::chrono::milliseconds(-99);
  EXPECT_EQ(list_findings(seen), Names{});
  seen.probes.clock_ahead = std::chrono::milliseconds(-101);
  EXPECT_EQ(list_findings(seen), Names{"clock"});
}

TEST(DiagnosisTest, SharedMemoryNeedsRoomForAFlight) {
  Observations seen = make_healthy_with_shared_memory();
  seen.programs.clear();
  seen.shared_memory.free = calc_shared_memory_need(seen.settings, 3);
  EXPECT_TRUE(list_findings(seen) == Names{"domain"} || list_findings(seen).empty());
  --seen.shared_memory.free;
  EXPECT_EQ(list_findings(seen).front(), "shared memory");
}

TEST(DiagnosisTest, AProgramWithAnotherSharedMemoryIsSilentAndItsPortIsNotThere) {
  Observations seen = make_healthy_with_shared_memory();
  seen.shared_memory.read_ports = {};
  EXPECT_EQ(list_findings(seen), Names{}) << "it started after we looked";
  seen.programs.front().samples = 0;
  EXPECT_EQ(list_findings(seen), (Names{"shared memory", "data"}));
}

TEST(DiagnosisTest, TwoUsersShareNoMemory) {
  Observations seen = make_healthy_with_shared_memory();
  seen.programs.front().user = "nobody";
  EXPECT_EQ(list_findings(seen), Names{"users"});
  seen.settings.uses_shared_memory = false;
  EXPECT_EQ(list_findings(seen), Names{});
}

TEST(DiagnosisTest, AnotherFlightOnAnotherDomainIsNoFault) {
  Observations seen = make_healthy();
  seen.heard = {{5, seen.peer_address, {}}};
  seen.heard.front().announcement.name = "sim_server";
  EXPECT_EQ(list_findings(seen), Names{});
  for (const char* name : {"recorder", "control_client", "sls_view"}) {
    seen.heard.front().announcement.name = name;
    EXPECT_EQ(list_findings(seen), Names{"domain"}) << name << " has lost its server";
  }
}

TEST(DiagnosisTest, AWholeFlightElsewhereIsNoFaultWhereNoProgramIs) {
  Observations seen = make_healthy();
  seen.programs.clear();
  seen.heard = {{5, seen.peer_address, {}}, {5, seen.peer_address, {}}};
  seen.heard[0].announcement.name = "sim_server";
  EXPECT_EQ(list_findings(seen), Names{"domain"}) << "it waits for others";
  seen.heard[1].announcement.name = "control_client";
  EXPECT_EQ(list_findings(seen), Names{});
}

TEST(DiagnosisTest, AMachineThatDoesNotReachItselfIsNamed) {
  Observations seen;
  seen.probes.is_tried = seen.probes.is_unreachable = true;
  seen.peer_address = "127.0.0.1";
  EXPECT_EQ(diagnose(seen)[3].text,
            "this machine does not reach itself at 127.0.0.1: the interface "
            "is down: ip link set lo up");
}

TEST(DiagnosisTest, AProgramThatAnswersNoHandshakeRejectsUs) {
  Observations seen = make_healthy();
  seen.settings.is_secured = seen.programs.front().is_secured = true;
  seen.refusal = "not allowed";
  EXPECT_EQ(list_findings(seen), Names{"security"});
  Endpoint endpoint;
  endpoint.participant = seen.programs.front().id;
  seen.endpoints = {endpoint};
  EXPECT_EQ(list_findings(seen), Names{});
  seen.settings.expiry = "key/certificate.pem ends";
  EXPECT_EQ(list_findings(seen), Names{}) << "until then it flies";
  const auto checks = diagnose(seen);
  EXPECT_TRUE(std::any_of(checks.begin(), checks.end(), [](const Check& check) {
    return check.text == "all programs have a valid identity; key/certificate.pem ends";
  }));
  seen.programs.front().is_secured = false;
  EXPECT_EQ(list_findings(seen), Names{"security"});
}

TEST(DiagnosisTest, CommandsInRealTimeHaveADeadlineOfTheirOwn) {
  Observations seen = make_healthy();
  Endpoint ours, theirs;
  ours.topic = theirs.topic = "sls/command";
  ours.is_writer = true;
  ours.participant.bytes[0] = 1;
  theirs.deadline = std::chrono::milliseconds(100);
  seen.own_endpoints = {ours};
  seen.endpoints = {theirs};
  EXPECT_EQ(list_findings(seen), Names{});
  seen.endpoints.front().is_reliable = true;
  EXPECT_EQ(list_findings(seen), Names{"qos"});
}

TEST(DiagnosisTest, WithoutAnotherFaultLostSamplesAreTheFault) {
  Observations seen = make_healthy();
  seen.programs.front().samples = 0;
  EXPECT_EQ(list_findings(seen), Names{"data"});
}

TEST(CheckTest, ALineHoldsNameVerdictAndText) {
  EXPECT_EQ(to_line({"ports", Verdict::kFinding, "blocked"}), "ports         FAULT    blocked");
}

TEST(CheckTest, JsonStaysValidWithAnyName) {
  const auto parsed = nlohmann::json::parse(
      to_json({{"data", Verdict::kOk, "from \"x\xff\""}, {"ports", Verdict::kFinding, "blocked"}}));
  EXPECT_FALSE(parsed.at("ok").get<bool>());
  EXPECT_EQ(parsed.at("checks").at(1).at("verdict"), "FAULT");
}

}  // namespace
}  // namespace sls::doctor
