#include "common/bus/participants.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>

#include "tests/support/own_domain.hpp"
#include "tests/support/waiting.hpp"

namespace sls::bus {
namespace {

using sls::test::own_domain;
using sls::test::wait_until;

constexpr std::uint64_t kRun = 500, kLowerRun = 400;
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
                     [&](const Run& run) { return run.parameters.run_id() == run_id; });
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
    EXPECT_FALSE(entry.is_silent());
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

TEST_F(AnnouncementTest, ARepeatedAnnouncementIsHeardButChangesNoVersion) {
  Writer<Participant> writer(other_);
  Participant message = make_announcement(ParticipantRole::ROLE_CONTROLLER, kRun, "pilot");
  write(writer, message);
  const auto version = directory_.version();
  write(writer, message);
  EXPECT_EQ(directory_.version(), version);
  message.ready(true);
  write(writer, message);
  EXPECT_NE(directory_.version(), version);
}

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

TEST_F(AnnouncementTest, AFewAnnouncementsInABurstAreNoRepetition) {
  Writer<Participant> writer(other_);
  const Participant message = make_announcement(ParticipantRole::ROLE_CONTROLLER, kRun, "pilot");
  for (int i = 0; i < 5; ++i) writer.write(message);
  write(writer, message);
  EXPECT_FALSE(find()->is_repeated);
}

class RecorderPatienceTest : public testing::Test {
 protected:
  /// Announces further steps until `time` is over or wait_for_recorder() returned; then announces
  /// that the recorder is done.
  void write_further_steps(std::chrono::steady_clock::duration time) {
    const auto end = std::chrono::steady_clock::now() + time;
    Participant message = make_announcement(ParticipantRole::ROLE_RECORDER, kRun, "recorder");
    wait_until([&] {
      message.last_complete_step(message.last_complete_step() + 1);
      writer_.write(message);
      return has_given_up_ || std::chrono::steady_clock::now() > end;
    });
    is_done_ = true;
    message.done(true);
    writer_.write(message);
  }
  /// Waits for the recorder with `patience`. @returns true if the recorder was done before.
  bool wait_for_recorder(const RecorderPatience& patience) {
    EXPECT_TRUE(wait_until(
        [&] { return directory_.find(ParticipantRole::ROLE_RECORDER, kRun).size() == 1; }));
    wait_for_recorders_to_end(directory_, kRun, 1, patience);
    const bool was_done = is_done_;
    has_given_up_ = true;
    return was_done;
  }

  Node node_{kQosFile, own_domain(), "directory"}, recorder_{kQosFile, own_domain(), "recorder"};
  const ParticipantDirectory directory_{node_};
  Writer<Participant> writer_{recorder_};
  std::atomic<bool> is_done_{false}, has_given_up_{false};
};

TEST_F(RecorderPatienceTest, OneThatGetsFurtherIsWaitedFor) {
  std::thread recording([this] { write_further_steps(std::chrono::seconds(3)); });
  EXPECT_TRUE(wait_for_recorder({2, 60}));
  recording.join();
}

TEST_F(RecorderPatienceTest, ButNotForEver) {
  std::thread recording([this] { write_further_steps(std::chrono::seconds(60)); });
  EXPECT_FALSE(wait_for_recorder({60, 0.5}));
  recording.join();
}

TEST_F(RecorderPatienceTest, OneThatGetsNoFurtherIsNot) {
  writer_.write(make_announcement(ParticipantRole::ROLE_RECORDER, kRun, "recorder"));
  EXPECT_FALSE(wait_for_recorder({0.5, 60}));
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

TEST(ServerDirectoryTest, FindsTheRunToJoin) {
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

  {  // chooses the run that is ahead; on a tie, the lower run_id
    Node second_server(kQosFile, own_domain(), "second server");
    Writer<Parameters> second_parameters(second_server);
    Writer<SimStatus> second_status(second_server);
    second_parameters.write(make_parameters(kLowerRun, {kVehicle}));
    second_status.write(make_status(kLowerRun, RunPhase::PHASE_WAITING));
    // Both servers repeat their status: a server silent for 2 s cannot be joined.
    const auto is_chosen = [&](std::uint64_t run_id, RunPhase phase) {
      return wait_until([&] {
        status.write(make_status(kRun, phase));
        second_status.write(make_status(kLowerRun, RunPhase::PHASE_WAITING));
        const auto run = directory.find_joinable(kVehicle);
        return run && run->parameters.run_id() == run_id;
      });
    };
    EXPECT_TRUE(is_chosen(kLowerRun, RunPhase::PHASE_WAITING));
    EXPECT_TRUE(is_chosen(kRun, RunPhase::PHASE_RUNNING));
    EXPECT_TRUE(is_chosen(kLowerRun, RunPhase::PHASE_FINISHED));
  }
  EXPECT_TRUE(wait_until([&] { return !directory.find_joinable(kVehicle); }));
  ASSERT_TRUE(directory.find_status(kLowerRun)) << "also of a server that has gone";
  EXPECT_EQ(directory.find_status(kLowerRun)->phase(), RunPhase::PHASE_WAITING);
  EXPECT_EQ(directory.find_status(kLowerRun + 1), std::nullopt);
}

TEST(ServerDirectoryTest, OnlyTheFirstServerOfARunCounts) {
  Node node(kQosFile, own_domain(), "directory");
  std::atomic<int> forged{0};
  const ServerDirectory directory(node, [&](const SimStatus& status) {
    if (status.run_id() == kRun && status.phase() == RunPhase::PHASE_FINISHED) ++forged;
  });
  const auto problem = [&] { return node.problems().describe(); };
  Node server(kQosFile, own_domain(), "server"), stranger(kQosFile, own_domain(), "stranger");
  Writer<Parameters> parameters(server), strangers_parameters(stranger);
  Writer<SimStatus> status(server), strangers_status(stranger);
  parameters.write(make_parameters(kRun, {kVehicle}));
  status.write(make_status(kRun, RunPhase::PHASE_RUNNING));
  ASSERT_TRUE(wait_until([&] { return directory.find_status(kRun).has_value(); }));

  strangers_status.write(make_status(kRun, RunPhase::PHASE_FINISHED));
  ASSERT_TRUE(wait_until([&] { return !problem().empty(); }));
  EXPECT_EQ(problem(),
            "'stranger' (127.0.0.1): sls/status run_id: expected that of a run of its own, got "
            "00000000000001f4, a run of 'server' (127.0.0.1); its samples are ignored");
  EXPECT_EQ(forged, 0);
  strangers_parameters.write(make_parameters(kRun, {kVehicle}));
  strangers_parameters.write(make_parameters(kLowerRun, {kVehicle}));
  strangers_parameters.write(make_parameters(kRun, {kVehicle}));
  ASSERT_TRUE(wait_until([&] { return !directory.may_fly(kLowerRun, kVehicle + 1); }));
  ASSERT_TRUE(wait_until([&] { return directory.runs().size() == 1; }));
  EXPECT_EQ(directory.find_status(kRun)->phase(), RunPhase::PHASE_RUNNING);
  EXPECT_TRUE(directory.is_known(kRun));
  EXPECT_FALSE(directory.is_known(kRun + 1));
  EXPECT_EQ(directory.runs().front().server, server.id());
}

TEST(ServerDirectoryTest, AStatusThatComesBeforeTheClaimOfItsServerIsReportedOnceThatComes) {
  Node node(kQosFile, own_domain(), "directory");
  std::atomic<int> statuses{0};
  const ServerDirectory directory(node, [&](const SimStatus&) { ++statuses; });
  Node server(kQosFile, own_domain(), "server"), stranger(kQosFile, own_domain(), "stranger");
  Writer<SimStatus> strangers_status(stranger);
  strangers_status.write(make_status(kRun, RunPhase::PHASE_FINISHED));
  ASSERT_TRUE(wait_until([&] { return statuses == 1; }));
  EXPECT_EQ(node.problems().describe(), "");
  Writer<Parameters> parameters(server);
  parameters.write(make_parameters(kRun, {kVehicle}));
  ASSERT_TRUE(wait_until([&] { return !node.problems().describe().empty(); }));
  EXPECT_EQ(directory.find_status(kRun), std::nullopt);
}

TEST(ServerDirectoryTest, AWriterOfStatesWithoutAClaimIsAnImpostor) {
  Node node(kQosFile, own_domain(), "directory");
  ServerDirectory directory(node);
  Node server(kQosFile, own_domain(), "server"), stranger(kQosFile, own_domain(), "stranger");
  Writer<Parameters> parameters(server);
  Writer<States> states(server), strangers_states(stranger);
  Writer<RecordBatch> strangers_batches(stranger);
  parameters.write(make_parameters(kRun, {kVehicle}));
  const auto began = std::chrono::steady_clock::now();
  ASSERT_TRUE(wait_until([&] {
    directory.look_for_impostors();
    return !node.problems().describe().empty();
  }));
  EXPECT_GE(std::chrono::steady_clock::now() - began, std::chrono::milliseconds(900));
  const std::string expected =
      "'stranger' (127.0.0.1): writes sls/record, sls/state: expected a claim in sls/parameters, "
      "got none; its samples are ignored";
  EXPECT_EQ(node.problems().describe(), expected);

  Writer<Parameters> strangers_parameters(stranger);
  strangers_parameters.write(make_parameters(kLowerRun, {kVehicle + 1}));
  EXPECT_TRUE(wait_until([&] {
    directory.look_for_impostors();
    return node.problems().describe().empty();
  })) << node.problems().describe();
}

// A late joiner receives the history of each topic; either topic may come first.
TEST(ServerDirectoryTest, AfterManyResetsTheLastRunIsFoundWhicheverTopicComesFirst) {
  constexpr std::uint64_t kRuns = 9;
  for (const bool are_parameters_first : {true, false}) {
    SCOPED_TRACE(are_parameters_first);
    Node node(kQosFile, own_domain(), "directory");
    std::atomic<std::uint64_t> last_status{0};
    const ServerDirectory directory(
        node, [&](const SimStatus& status) { last_status = status.run_id(); });
    Node server(kQosFile, own_domain(), "server");
    Writer<Parameters> parameters(server);
    Writer<SimStatus> status(server);
    const std::uint64_t last = kRun + kRuns - 1;
    const auto write_parameters = [&] {
      for (std::uint64_t i = 0; i < kRuns; ++i)
        parameters.write(make_parameters(kRun + i, {kVehicle}));
      EXPECT_TRUE(wait_until([&] { return knows(directory, last); }));
    };
    if (are_parameters_first) write_parameters();
    for (std::uint64_t i = 0; i < kRuns; ++i)
      for (const RunPhase phase : {RunPhase::PHASE_WAITING,
                                   i + 1 < kRuns ? RunPhase::PHASE_RESET : RunPhase::PHASE_RUNNING})
        status.write(make_status(kRun + i, phase));
    ASSERT_TRUE(wait_until([&] { return last_status == last; }));
    if (!are_parameters_first) write_parameters();
    // A recorder reads from the last status of its run that the run was reset.
    ASSERT_TRUE(directory.find_status(last - 1));
    EXPECT_EQ(directory.find_status(last - 1)->phase(), RunPhase::PHASE_RESET);
    ASSERT_TRUE(wait_until([&] {
      status.write(make_status(last, RunPhase::PHASE_RUNNING));
      return directory.find_joinable(kVehicle).has_value();
    }));
    EXPECT_EQ(directory.find_joinable(kVehicle)->parameters.run_id(), last);
  }
}

TEST(ServerWatchTest, ASilentServerIsNotJoinedIsGivenUpAndMayComeBack) {
  Node node(kQosFile, own_domain(), "directory");
  const ServerDirectory directory(node);
  Node server(kQosFile, own_domain(), "server");
  Writer<Parameters> parameters(server);
  Writer<SimStatus> status(server);
  parameters.write(make_parameters(kRun, {kVehicle}));
  const auto is_there = [&] {
    status.write(make_status(kRun, RunPhase::PHASE_RUNNING));
    return directory.find_joinable(kVehicle).has_value();
  };
  ASSERT_TRUE(wait_until(is_there));
  ServerWatch watch(directory, *directory.find_joinable(kVehicle), 1.0);
  EXPECT_EQ(watch.look(), ServerWatch::Finding::kThere);
  EXPECT_FALSE(directory.is_silent(kRun));
  EXPECT_TRUE(wait_until([&] { return watch.look() == ServerWatch::Finding::kSilent; }));
  EXPECT_TRUE(wait_until([&] { return watch.look() == ServerWatch::Finding::kLost; }));
  EXPECT_NE(watch.describe().find("silent for "), std::string::npos);
  EXPECT_TRUE(wait_until([&] { return directory.is_silent(kRun); }));
  EXPECT_FALSE(directory.find_joinable(kVehicle)) << "somebody else may take its place";
  EXPECT_TRUE(directory.is_present(server.id())) << "it has not left";

  ASSERT_TRUE(wait_until(is_there));
  EXPECT_TRUE(wait_until([&] {
    status.write(make_status(kRun, RunPhase::PHASE_RUNNING));
    return watch.look() == ServerWatch::Finding::kThere;
  }));
  // A watch that was stopped itself and so did not look for a while does not report the server.
  const auto later = ServerWatch::Clock::now() + std::chrono::milliseconds(1500);
  ASSERT_TRUE(wait_until([&] { return ServerWatch::Clock::now() > later; }));
  EXPECT_EQ(watch.look(), ServerWatch::Finding::kThere);
}

// A server is also presumed dead if its samples are late because this process or the network is
// overloaded. A second server that claimed the same vehicle before must not take its place then.
TEST(ServerDirectoryTest, OnlyAServerThatComesAfterTheSilenceBeganIsASuccessor) {
  Node node(kQosFile, own_domain(), "directory");
  const ServerDirectory directory(node);
  Node server(kQosFile, own_domain(), "server"), stranger(kQosFile, own_domain(), "stranger");
  Writer<Parameters> parameters(server), strangers_parameters(stranger);
  Writer<SimStatus> status(server), strangers_status(stranger);
  parameters.write(make_parameters(kRun, {kVehicle}));
  strangers_parameters.write(make_parameters(kLowerRun, {kVehicle}));
  auto joined = directory.find_joinable(kVehicle);
  ASSERT_TRUE(wait_until([&] {
    status.write(make_status(kRun, RunPhase::PHASE_RUNNING));
    strangers_status.write(make_status(kLowerRun, RunPhase::PHASE_WAITING));
    joined = directory.find_joinable(kVehicle);
    return joined && joined->server == server.id() && knows(directory, kLowerRun);
  }));
  const auto run = *joined;
  EXPECT_EQ(directory.find_successor(run, {kVehicle}), std::nullopt);
  // The server is heard once more: the stranger was there before the silence begins.
  SimStatus last = make_status(kRun, RunPhase::PHASE_RUNNING);
  last.sample_index(1);
  status.write(last);
  ASSERT_TRUE(wait_until([&] { return directory.find_status(kRun)->sample_index() == 1; }));

  ASSERT_TRUE(wait_until([&] {
    strangers_status.write(make_status(kLowerRun, RunPhase::PHASE_WAITING));
    return directory.is_silent(kRun) && knows(directory, kLowerRun);
  }));
  EXPECT_EQ(directory.find_successor(run, {kVehicle}), std::nullopt);

  Node replacement(kQosFile, own_domain(), "replacement");
  Writer<Parameters> next_parameters(replacement);
  Writer<SimStatus> next_status(replacement);
  next_parameters.write(make_parameters(kRun + 1, {kVehicle}));
  const auto is_found = [&](std::uint64_t run_id) {
    return wait_until([&] {
      strangers_status.write(make_status(kLowerRun, RunPhase::PHASE_WAITING));
      next_status.write(make_status(kRun + 1, RunPhase::PHASE_WAITING));
      const auto next = directory.find_successor(run, {kVehicle});
      return next && next->parameters.run_id() == run_id;
    });
  };
  EXPECT_TRUE(is_found(kRun + 1));
  EXPECT_EQ(directory.find_successor(run, {kVehicle + 1}), std::nullopt);

  // The run's own server may start another run at any time.
  parameters.write(make_parameters(kRun + 2, {kVehicle}));
  status.write(make_status(kRun + 2, RunPhase::PHASE_RUNNING));
  EXPECT_TRUE(is_found(kRun + 2));
}

TEST(ServerDirectoryTest, AServerDoesNotMeetItself) {
  Node node(kQosFile, own_domain(), "server");
  const ServerDirectory directory(node);
  Writer<Parameters> parameters(node);
  Writer<SimStatus> status(node);
  parameters.write(make_parameters(kRun, {kVehicle}));
  status.write(make_status(kRun, RunPhase::PHASE_RUNNING));
  ASSERT_TRUE(wait_until([&] { return directory.find_status(kRun).has_value(); }));
  ASSERT_TRUE(wait_until([&] { return directory.is_present(node.id()); }));
  EXPECT_FALSE(knows(directory, kRun));
  EXPECT_EQ(directory.find_joinable(kVehicle), std::nullopt);
}

TEST(ParticipantsTest, ARunningServerIsFurtherThanAWaitingOneAndAnEndedOneIsNoServer) {
  const auto progress = [](RunPhase phase) { return calc_progress(make_status(1, phase)); };
  EXPECT_LT(calc_progress(std::nullopt), progress(RunPhase::PHASE_WAITING));
  EXPECT_LT(progress(RunPhase::PHASE_WAITING), progress(RunPhase::PHASE_RUNNING));
  EXPECT_EQ(progress(RunPhase::PHASE_RUNNING), progress(RunPhase::PHASE_PAUSED));
  EXPECT_LT(progress(RunPhase::PHASE_FINISHED), 0);
  EXPECT_LT(progress(RunPhase::PHASE_FAILED), 0);
}

TEST(ParticipantsTest, AServerServesTheVehiclesItNames) {
  EXPECT_TRUE(serves_vehicle(make_parameters(1, {0, 7}), 7));
  EXPECT_FALSE(serves_vehicle(make_parameters(1, {0, 7}), 1));
  EXPECT_FALSE(serves_vehicle(make_parameters(1, {}), 0));
  EXPECT_EQ(list_vehicle_ids(make_parameters(1, {0, 7})), std::vector<std::uint32_t>({0, 7}));
}

TEST(ParticipantsTest, TheHostsNameFitsTheWire) {
  EXPECT_FALSE(host_name().empty());
  EXPECT_LE(host_name().size(), 64u);
}

}  // namespace
}  // namespace sls::bus
