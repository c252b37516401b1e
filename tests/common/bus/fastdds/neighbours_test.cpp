#include "common/bus/fastdds/neighbours.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "common/bus/topics.hpp"

namespace sls::bus {
namespace {

using namespace std::chrono_literals;
using Durability = EndpointFacts::Durability;
using Liveliness = EndpointFacts::Liveliness;

EndpointFacts make_endpoint(const std::string& topic, const std::string& type, bool is_writer) {
  EndpointFacts facts;
  facts.topic = topic;
  facts.type = type;
  facts.is_writer = is_writer;
  facts.is_reliable = true;
  facts.durability = Durability::kTransientLocal;
  return facts;
}

PeerId make_peer(std::uint8_t number) {
  PeerId peer;
  peer.bytes.fill(number);
  return peer;
}

constexpr Neighbours::EntityId kFirst = {0, 0, 1, 3}, kSecond = {0, 0, 2, 4};

class NeighboursTest : public testing::Test {
 protected:
  void SetUp() override {
    neighbours_.set_self(make_peer(9));
    neighbours_.note_participant(make_peer(1), "foo", "10.0.0.2");
    neighbours_.add_own(own_);
  }
  /// Problems of a writer of sls/command that differs from ours by `change`.
  std::string judge(const std::function<void(EndpointFacts&)>& change) {
    EndpointFacts facts = make_endpoint("sls/command", "sls::Commands", true);
    change(facts);
    neighbours_.note_endpoint(make_peer(1), kFirst, facts);
    return problems_.describe();
  }

  Problems problems_;
  Neighbours neighbours_{problems_};
  const EndpointFacts own_ = make_endpoint("sls/command", "sls::Commands", false);
};

TEST_F(NeighboursTest, EveryPolicyIsNamedWithOfferedAndRequestedValue) {
  const std::string begin = "sls/command of 'foo' (10.0.0.2): ";
  const std::vector<std::pair<std::function<void(EndpointFacts&)>, std::string>> cases = {
      {[](auto& facts) { facts.is_reliable = false; },
       "RELIABILITY: offered best effort, asked reliable"},
      {[](auto& facts) { facts.durability = Durability::kVolatile; },
       "DURABILITY: offered volatile, asked transient local"},
      {[](auto& facts) { facts.is_exclusive = true; },
       "OWNERSHIP: offered exclusive, asked shared"},
      {[](auto& facts) {
         facts.partitions = {"a", "b"};
       },
       "PARTITION: offered 'a', 'b', asked none"},
      {[](auto& facts) { facts.representations = {2}; },
       "DATA_REPRESENTATION: offered XCDR2, asked XCDR1 (compile the types as @final)"},
      {[](auto& facts) { facts.type = "sls::Other"; },
       "type: expected sls::Commands, got sls::Other"},
      {[](auto& facts) { facts.is_keyed = true; }, "key: expected none, got a keyed type"},
      {[](auto& facts) {
         facts.is_reliable = false;
         facts.durability = Durability::kVolatile;
       },
       "RELIABILITY: offered best effort, asked reliable; DURABILITY: offered volatile, asked "
       "transient local"}};
  for (const auto& [change, expected] : cases) {
    EXPECT_EQ(judge(change), begin + expected);
    neighbours_.drop_endpoint(make_peer(1), kFirst);
    problems_.end_all("");
    EXPECT_EQ(problems_.describe(), "");
  }
  EXPECT_EQ(judge([](auto&) {}), "");
}

TEST(EndpointFactsTest, LivelinessAndDeadline) {
  EndpointFacts writer = make_endpoint("sls/command", "sls::Commands", true);
  EndpointFacts reader = make_endpoint("sls/command", "sls::Commands", false);
  EXPECT_TRUE(find_mismatches(writer, reader).empty());
  reader.deadline = 100ms;
  reader.lease = 2s;
  reader.liveliness = Liveliness::kManualByTopic;
  auto found = find_mismatches(writer, reader);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].text, "DEADLINE: offered none, asked 0.1 s");
  EXPECT_EQ(found[1].text, "LIVELINESS: offered automatic, asked manual by topic");
  EXPECT_EQ(found[2].text, "LIVELINESS lease: offered none, asked 2 s");
  writer.deadline = 100ms;
  writer.lease = 1s;
  writer.liveliness = Liveliness::kManualByTopic;
  EXPECT_TRUE(find_mismatches(writer, reader).empty());
  writer.deadline = 200ms;
  found = find_mismatches(writer, reader);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].text, "DEADLINE: offered 0.2 s, asked 0.1 s");
}

TEST_F(NeighboursTest, ReadersOfOursAreNamedAsSuch) {
  neighbours_.add_own(make_endpoint("sls/state", "sls::States", true));
  EndpointFacts reader = make_endpoint("sls/state", "sls::States", false);
  reader.deadline = 10ms;
  neighbours_.note_endpoint(make_peer(1), kSecond, reader);
  EXPECT_EQ(problems_.describe(),
            "sls/state for 'foo' (10.0.0.2): DEADLINE: offered none, asked 0.01 s");
}

TEST_F(NeighboursTest, EndpointsOfOursThatComeLaterAreCompared) {
  EndpointFacts writer = make_endpoint("sls/participant", "sls::Participant", true);
  writer.durability = Durability::kVolatile;
  neighbours_.note_endpoint(make_peer(1), kSecond, writer);
  EXPECT_EQ(problems_.describe(), "");
  const EndpointFacts own = make_endpoint("sls/participant", "sls::Participant", false);
  neighbours_.add_own(own);
  EXPECT_NE(problems_.describe(), "");
  neighbours_.drop_own(own);
  EXPECT_EQ(problems_.describe(), "");
}

TEST_F(NeighboursTest, ProblemsOfAParticipantEndWhenItLeaves) {
  judge([](auto& facts) { facts.is_exclusive = true; });
  EXPECT_EQ(neighbours_.find_misfits(), std::set<PeerId>{make_peer(1)});
  neighbours_.drop_participant(make_peer(1));
  EXPECT_EQ(problems_.describe(), "");
  EXPECT_TRUE(neighbours_.find_misfits().empty());
}

TEST_F(NeighboursTest, TopicsOfOthersAndOurOwnEndpointsDoNotCount) {
  neighbours_.add_own(make_endpoint("other", "Type", false));
  neighbours_.note_endpoint(make_peer(1), kFirst, make_endpoint("other", "Wrong", true));
  neighbours_.note_endpoint(make_peer(9), kFirst, make_endpoint("sls/command", "Wrong", true));
  EXPECT_EQ(problems_.describe(), "");
}

TEST_F(NeighboursTest, TopicsThatResembleOursAreNamedWithTheOneThatIsMeant) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"sls/commands", "sls/command"},
      {"/sls/command", "sls/command"},
      {"sls_command", "sls/command"},
      {"SLS/Command", "sls/command"},
      {"sls/commandd", "sls/command"},
      {"sls/states", "sls/state"},
      {"sls/control-reply", "sls/control_reply"},
      {"slscommand", "sls/command"},
      {"command", "sls/command"}};
  for (const auto& [topic, meant] : cases) {
    neighbours_.note_endpoint(make_peer(1), kFirst, make_endpoint(topic, "sls::Commands", true));
    EXPECT_EQ(problems_.describe(), topic + " of 'foo' (10.0.0.2): expected topic " + meant);
    neighbours_.drop_endpoint(make_peer(1), kFirst);
    EXPECT_EQ(problems_.describe(), "");
  }
}

TEST_F(NeighboursTest, TheNamesOfRos2AreReportedOncePerParticipant) {
  neighbours_.note_endpoint(make_peer(1), kFirst,
                            make_endpoint("rt/sls/state", "sls::msg::dds_::States_", false));
  neighbours_.note_endpoint(make_peer(1), kSecond,
                            make_endpoint("rt/sls/command", "sls::msg::dds_::Commands_", true));
  EXPECT_EQ(problems_.describe(),
            "rt/sls/state for 'foo' (10.0.0.2): expected topic sls/state (without the prefix of "
            "ROS 2)");
  EXPECT_EQ(neighbours_.find_misfits(), std::set<PeerId>{make_peer(1)});
}

/// Topics of other applications, of sls_view --ros, of the doctor, and of a user beside ours.
TEST_F(NeighboursTest, TopicsThatMeanSomethingElseAreNoMistake) {
  for (const char* topic :
       {"rt/tf", "rt/sls/vehicle_0/load/pose", "rt/sls/vehicle_0/markers", "ros_discovery_info",
        "rt/command", "command", "state", "rt/robot/state", "status", "sls/doctor", "sls/wind"})
    neighbours_.note_endpoint(make_peer(1), kFirst, make_endpoint(topic, "other::Type", true));
  EXPECT_EQ(problems_.describe(), "");
  for (const char* topic : kTopicNames)
    EXPECT_FALSE(find_meant_topic(make_endpoint(topic, "sls::Type", true))) << topic;
}

TEST_F(NeighboursTest, TheNameThatAParticipantAnnouncesReplacesThatOfDiscovery) {
  neighbours_.note_participant(make_peer(1), "", "10.0.0.2");
  judge([](auto& facts) { facts.is_exclusive = true; });
  const std::string mistake = ": OWNERSHIP: offered exclusive, asked shared";
  EXPECT_EQ(problems_.describe(),
            "sls/command of a participant without a name (10.0.0.2)" + mistake);
  neighbours_.note_announced_name(make_peer(1), "");
  neighbours_.note_announced_name(make_peer(1), "bar");
  EXPECT_EQ(problems_.describe(), "sls/command of 'bar' (10.0.0.2)" + mistake);
  neighbours_.note_problem(make_peer(1), "key", "text");
  EXPECT_EQ(problems_.describe(),
            "sls/command of 'bar' (10.0.0.2)" + mistake + "; 'bar' (10.0.0.2): text");
  neighbours_.note_participant(make_peer(1), "entity", "10.0.0.2");  // discovered again
  EXPECT_EQ(neighbours_.describe(make_peer(1)), "'bar' (10.0.0.2)");
}

TEST_F(NeighboursTest, AMissingDeadlineIsOfTheAnnouncedName) {
  EndpointFacts own = own_;
  own.deadline = 100ms;
  neighbours_.add_own(own);
  judge([](auto&) {});
  problems_.begin("run 010101010101010101010101 deadline",  // as the server reports it
                  neighbours_.find_missing_deadlines().at(make_peer(1)));
  neighbours_.note_announced_name(make_peer(1), "bar");
  const std::string expected =
      "sls/command of 'bar' (10.0.0.2): DEADLINE: offered none, asked 0.1 s";
  EXPECT_EQ(neighbours_.find_missing_deadlines().at(make_peer(1)), expected);
  EXPECT_EQ(problems_.describe(), expected);
}

TEST_F(NeighboursTest, WritersOfWhatServersWriteAreFound) {
  neighbours_.note_endpoint(make_peer(1), kFirst, make_endpoint("sls/state", "sls::States", true));
  neighbours_.note_endpoint(make_peer(1), kSecond,
                            make_endpoint("sls/status", "sls::SimStatus", true));
  neighbours_.note_endpoint(make_peer(2), kFirst,
                            make_endpoint("sls/record", "sls::RecordBatch", false));
  const std::map<PeerId, std::set<std::string>> expected = {
      {make_peer(1), {"sls/state", "sls/status"}}};
  EXPECT_EQ(neighbours_.find_writers_of_servers(), expected);
}

TEST_F(NeighboursTest, AnObstacleIsNamedOnceTheParticipantHasEndpointsOfOurs) {
  neighbours_.note_participant(make_peer(2), "bar", "", "another vendor's DDS");
  EXPECT_EQ(problems_.describe(), "");
  neighbours_.note_endpoint(make_peer(2), kFirst, make_endpoint("other", "Type", true));
  EXPECT_EQ(problems_.describe(), "");
  neighbours_.note_endpoint(make_peer(2), kFirst, own_);
  EXPECT_EQ(problems_.describe(), "'bar': another vendor's DDS");
}

TEST_F(NeighboursTest, AMissingDeadlineIsForTheServerToJudge) {
  EndpointFacts own = own_;
  own.deadline = 100ms;
  neighbours_.add_own(own);
  EXPECT_EQ(judge([](auto&) {}), "");
  const std::map<PeerId, std::string> expected = {
      {make_peer(1), "sls/command of 'foo' (10.0.0.2): DEADLINE: offered none, asked 0.1 s"}};
  EXPECT_EQ(neighbours_.find_missing_deadlines(), expected);
  neighbours_.drop_endpoint(make_peer(1), kFirst);
  EXPECT_TRUE(neighbours_.find_missing_deadlines().empty());
}

TEST_F(NeighboursTest, SamplesThatDoNotFitAreNamedWhereTheirWriterIsKnown) {
  neighbours_.note_misfit(make_peer(1), kFirst, "sls/command", "sls::Commands", "too long");
  EXPECT_EQ(problems_.describe(), "");
  judge([](auto&) {});
  neighbours_.note_misfit(make_peer(1), kFirst, "sls/command", "sls::Commands", "too long");
  EXPECT_EQ(problems_.describe(), "sls/command of 'foo' (10.0.0.2): sls::Commands: too long");
}

TEST_F(NeighboursTest, NamesAreShownPrintable) {
  neighbours_.note_participant(make_peer(2), "a\nb", "10.0.0.3");
  neighbours_.note_participant(make_peer(3), "", "");
  EXPECT_EQ(neighbours_.describe(make_peer(2)).find('\n'), std::string::npos);
  EXPECT_EQ(neighbours_.describe(make_peer(3)), "a participant without a name");
}

}  // namespace
}  // namespace sls::bus
