#include "common/bus/participants.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>

#include "tests/support/own_domain.hpp"
#include "tests/support/waiting.hpp"

namespace sls::bus {
namespace {

using sls::test::own_domain;
using sls::test::wait_until;

constexpr std::uint64_t kRun = 500;
constexpr std::uint32_t kVehicle = 4;

const std::filesystem::path kQosFile = SLS_SOURCE_DIR "/config/qos/default.xml";

Participant make_announcement(ParticipantRole role, std::uint64_t run_id, const std::string& name) {
  Participant message;
  message.role(role);
  message.run_id(run_id);
  message.name(name);
  return message;
}

SimStatus make_status(std::uint64_t run_id, RunPhase phase) {
  SimStatus status;
  status.run_id(run_id);
  status.phase(phase);
  return status;
}

Parameters make_parameters(std::uint64_t run_id, const std::vector<std::uint32_t>& vehicle_ids) {
  Parameters parameters;
  parameters.contract_sha256(kContractSha256);
  parameters.run_id(run_id);
  for (const std::uint32_t id : vehicle_ids) parameters.vehicles().emplace_back().vehicle_id(id);
  return parameters;
}

bool knows(const ServerDirectory& directory, std::uint64_t run_id) {
  const auto runs = directory.runs();
  return std::any_of(runs.begin(), runs.end(),
                     [&](const sync::Run& run) { return run.parameters.run_id() == run_id; });
}

TEST(ParticipantDirectoryTest, ReplacesTheNameOfDiscoveryByTheAnnouncedOne) {
  Node node(kQosFile, own_domain(), "directory");
  const ParticipantDirectory directory(node);
  Node other(kQosFile, own_domain(), "");
  Writer<Participant> writer(other);
  ASSERT_TRUE(wait_until([&] { return !directory.writers().empty(); }));
  node.note_problem(other.id(), "key", "is wrong");
  EXPECT_EQ(node.problems().describe(), "a participant without a name (127.0.0.1): is wrong");
  writer.write(make_announcement(ParticipantRole::ROLE_CONTROLLER, 0, "pilot"));
  EXPECT_TRUE(wait_until([&] {
    return node.problems().describe() == "'pilot' (127.0.0.1): is wrong";
  })) << node.problems().describe();
  EXPECT_EQ(node.describe(other.id()), "'pilot' (127.0.0.1)");
}

TEST(ParticipantDirectoryTest, ListsTheParticipantsOfARunUntilTheyLeave) {
  Node node(kQosFile, own_domain(), "directory");
  const ParticipantDirectory directory(node);
  const auto version = directory.version();
  {
    Node other(kQosFile, own_domain(), "other");
    Writer<Participant> writer(other);
    writer.write(make_announcement(ParticipantRole::ROLE_CONTROLLER, 0, "pilot"));
    writer.write(
        make_announcement(ParticipantRole::ROLE_CONTROLLER, kRun, "pilot"));  // replaces the first
    ASSERT_TRUE(wait_until(
        [&] { return directory.find(ParticipantRole::ROLE_CONTROLLER, kRun).size() == 1; }));
    const auto entry = directory.find(ParticipantRole::ROLE_CONTROLLER, kRun).front();
    EXPECT_EQ(entry.peer, other.id());
    EXPECT_STREQ(entry.announcement.name().c_str(), "pilot");
    EXPECT_TRUE(directory.find(ParticipantRole::ROLE_RECORDER, kRun).empty());
    EXPECT_TRUE(directory.find(ParticipantRole::ROLE_CONTROLLER, kRun + 1).empty());
    EXPECT_NE(directory.version(), version);
    Participant done = make_announcement(ParticipantRole::ROLE_CONTROLLER, kRun, "pilot");
    done.done(true);
    EXPECT_EQ(directory.count_done(ParticipantRole::ROLE_CONTROLLER, kRun), 0);
    writer.write(done);
    EXPECT_TRUE(wait_until(
        [&] { return directory.count_done(ParticipantRole::ROLE_CONTROLLER, kRun) == 1; }));
  }
  EXPECT_TRUE(
      wait_until([&] { return directory.find(ParticipantRole::ROLE_CONTROLLER, kRun).empty(); }));
  EXPECT_EQ(directory.count_done(ParticipantRole::ROLE_CONTROLLER, kRun), 1)
      << "also after it has left";
}

/// One participant that announces itself.
class AnnouncementTest : public testing::Test {
 protected:
  std::optional<sync::Member> find() const {
    const auto found = directory_.find(ParticipantRole::ROLE_CONTROLLER, kRun);
    return found.empty() ? std::nullopt : std::optional(found.front());
  }
  /// Writes `message` and waits until the directory has heard it.
  void write(Writer<Participant>& writer, const Participant& message) {
    const auto before = find() ? find()->heard : std::chrono::steady_clock::time_point();
    writer.write(message);
    ASSERT_TRUE(wait_until([&] { return find() && find()->heard > before; }));
  }

  Node node_{kQosFile, own_domain(), "directory"}, other_{kQosFile, own_domain(), "other"};
  const ParticipantDirectory directory_{node_};
};

TEST_F(AnnouncementTest, AnAnnouncerRepeatsItselfAndTheDirectoryNoticesThat) {
  Announcer announcer(other_);
  announcer.repeat_if_due();  // nothing to repeat
  announcer.announce(make_announcement(ParticipantRole::ROLE_CONTROLLER, kRun, "pilot"));
  ASSERT_TRUE(wait_until([&] { return find().has_value(); }));
  EXPECT_FALSE(find()->is_repeated);
  EXPECT_TRUE(wait_until([&] {
    announcer.repeat_if_due();
    return find()->is_repeated;
  }));
  Participant ready = make_announcement(ParticipantRole::ROLE_CONTROLLER, kRun, "pilot");
  ready.ready(true);
  announcer.announce(ready);
  ASSERT_TRUE(wait_until([&] { return find()->announcement.ready(); }));
  EXPECT_FALSE(find()->is_repeated) << "this one is new";
}

TEST(ServerDirectoryTest, AServerOfAnotherContractIsIgnoredAndReported) {
  Node node(kQosFile, own_domain(), "directory");
  const ServerDirectory directory(node);
  Node other(kQosFile, own_domain(), "other");
  Writer<Parameters> parameters(other);
  Parameters sample = make_parameters(kRun, {kVehicle});
  sample.contract_sha256(std::string(64, '0'));
  parameters.write(sample);
  ASSERT_TRUE(wait_until([&] { return !node.problems().describe().empty(); }));
  EXPECT_EQ(node.problems().describe(),
            "'other' (127.0.0.1): sls/parameters contract_sha256: expected " +
                std::string(kContractSha256) + ", got " + std::string(64, '0'));
  EXPECT_FALSE(knows(directory, kRun));
}

TEST(ServerDirectoryTest, AServerIsAwaitedFromItsDiscoveryToItsClaim) {
  Node node(kQosFile, own_domain(), "directory");
  const ServerDirectory directory(node);
  EXPECT_TRUE(directory.has_heard_every_claim());
  Node client(kQosFile, own_domain(), "control_client"),
      server(kQosFile, own_domain(), kServerNode);
  ASSERT_TRUE(wait_until([&] { return !node.find_named(kServerNode).empty(); }));
  EXPECT_FALSE(directory.has_heard_every_claim()) << "discovered without a writer";
  Writer<Parameters> parameters(server);
  ASSERT_TRUE(wait_until([&] { return directory.is_present(server.id()); }));
  EXPECT_FALSE(directory.has_heard_every_claim()) << "matched without a sample";
  parameters.write(make_parameters(kRun, {kVehicle}));
  EXPECT_TRUE(wait_until([&] { return directory.has_heard_every_claim(); }));
}

TEST(ServerDirectoryTest, AWriterOfClaimsIsAwaitedUnderAnyName) {
  Node node(kQosFile, own_domain(), "directory");
  const ServerDirectory directory(node);
  Node server(kQosFile, own_domain(), "another server");
  Writer<Parameters> parameters(server);
  ASSERT_TRUE(wait_until([&] { return directory.is_present(server.id()); }));
  EXPECT_FALSE(directory.has_heard_every_claim());
  parameters.write(make_parameters(kRun, {kVehicle}));
  EXPECT_TRUE(wait_until([&] { return directory.has_heard_every_claim(); }));
}

TEST(ServerDirectoryTest, AProgramOfThisMachineIsAwaitedBeforeItIsDiscovered) {
  Node node(kQosFile, own_domain(), "directory");
  const ServerDirectory directory(node);
  EXPECT_TRUE(directory.has_heard_every_claim());
  {  // another process that has opened its port but has not been discovered
    const int port = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(7410 + 250 * own_domain() + 2 * 100));
    ASSERT_EQ(bind(port, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_FALSE(directory.has_heard_every_claim());
    close(port);
  }
  EXPECT_TRUE(directory.has_heard_every_claim());
}

TEST(ServerDirectoryTest, HearsClaimsAndStatuses) {
  Node node(kQosFile, own_domain(), "directory");
  std::atomic<int> statuses{0};
  const ServerDirectory directory(node, [&](const SimStatus& status) {
    if (status.run_id() == kRun) ++statuses;
  });
  Node own_server(kQosFile, own_domain(), "server");
  Writer<Parameters> parameters(own_server);
  Writer<SimStatus> status(own_server);

  parameters.write(make_parameters(kRun, {kVehicle - 1, kVehicle}));
  ASSERT_TRUE(wait_until([&] { return knows(directory, kRun); }));
  EXPECT_EQ(directory.find_joinable(kVehicle), std::nullopt) << "the claim is not settled";

  status.write(make_status(kRun, RunPhase::PHASE_WAITING));
  ASSERT_TRUE(wait_until([&] { return directory.find_joinable(kVehicle).has_value(); }));
  EXPECT_EQ(directory.find_joinable(kVehicle)->parameters.run_id(), kRun);
  EXPECT_EQ(directory.find_joinable(kVehicle)->server, own_server.id());
  EXPECT_EQ(directory.find_joinable(kVehicle + 1), std::nullopt);
  EXPECT_TRUE(directory.is_present(own_server.id()));
  EXPECT_EQ(statuses, 1);
}

TEST(ParticipantsTest, TheHostsNameFitsTheWire) {
  EXPECT_FALSE(host_name().empty());
  EXPECT_LE(host_name().size(), 64u);
}

}  // namespace
}  // namespace sls::bus
