#include "tools/doctor/endpoint.hpp"

#include <gtest/gtest.h>

namespace sls::doctor {
namespace {

Endpoint make(const std::string& owner, bool is_writer) {
  Endpoint endpoint;
  endpoint.participant.bytes[0] = is_writer ? 1 : 2;
  endpoint.owner = owner;
  endpoint.topic = "sls/state";
  endpoint.type = "sls::States";
  endpoint.is_writer = is_writer;
  return endpoint;
}

class EndpointTest : public testing::Test {
 protected:
  Endpoint writer_ = make("sim_server", true), reader_ = make("recorder", false);

  std::string find_policy() const {
    const auto found = find_policy_mismatches(writer_, reader_);
    return found.size() == 1 ? found.front().policy : std::to_string(found.size()) + " mismatches";
  }
};

TEST_F(EndpointTest, EqualPoliciesMatch) {
  EXPECT_TRUE(find_policy_mismatches(writer_, reader_).empty());
}

TEST_F(EndpointTest, AWriterMayOfferMoreThanIsAskedFor) {
  writer_.policies.reliability = 1;
  writer_.policies.durability = 1;
  writer_.policies.deadline_ns = 1'000'000;
  writer_.policies.liveliness = 2;
  EXPECT_TRUE(find_policy_mismatches(writer_, reader_).empty());
}

TEST_F(EndpointTest, EachPolicyThatIsOfferedTooLittleIsNamed) {
  reader_.policies.reliability = 1;
  EXPECT_EQ(find_policy(), "reliability");
  reader_.policies = {};
  reader_.policies.durability = 1;
  EXPECT_EQ(find_policy(), "durability");
  reader_.policies = {};
  reader_.policies.deadline_ns = 100'000'000;
  EXPECT_EQ(find_policy(), "deadline");
  reader_.policies = {};
  reader_.policies.liveliness = 1;
  EXPECT_EQ(find_policy(), "liveliness");
  reader_.policies = {};
  reader_.policies.liveliness_lease_ns = 1;
  EXPECT_EQ(find_policy(), "liveliness lease");
  reader_.policies = {};
  reader_.policies.ownership = 1;
  EXPECT_EQ(find_policy(), "ownership");
  reader_.policies = {};
  reader_.policies.partitions = {"b"};
  EXPECT_EQ(find_policy(), "partition");
  writer_.policies.partitions = {"*"};
  EXPECT_TRUE(find_policy_mismatches(writer_, reader_).empty());
}

TEST_F(EndpointTest, AMismatchSaysWhoOffersWhatAndWhoAsks) {
  reader_.policies.reliability = 1;
  EXPECT_EQ(find_policy_mismatches(writer_, reader_).front().text,
            "sim_server offers reliability BEST_EFFORT, recorder asks for RELIABLE");
}

TEST_F(EndpointTest, OnlyEndpointsOfOneTopicAndTwoParticipantsAreCompared) {
  reader_.policies.reliability = 1;
  EXPECT_EQ(find_policy_mismatches({writer_, reader_, reader_}).size(), 1u);
  Endpoint other = reader_;
  other.topic = "sls/command";
  EXPECT_TRUE(find_policy_mismatches({writer_, other}).empty());
  reader_.participant = writer_.participant;
  EXPECT_TRUE(find_policy_mismatches({writer_, reader_}).empty());
}

TEST_F(EndpointTest, AnotherTypeNameOrAnotherSizeIsATypeMismatch) {
  EXPECT_TRUE(find_type_mismatches({writer_, reader_}).empty());
  Endpoint other = writer_;
  writer_.max_size = 400;
  EXPECT_TRUE(find_type_mismatches({writer_, other}).empty()) << "an unknown size";
  other.max_size = 392;
  ASSERT_EQ(find_type_mismatches({writer_, other}).size(), 1u);
  reader_.type = "sls::SimStatus";
  EXPECT_EQ(find_type_mismatches({writer_, reader_}).front().text,
            "sim_server has type sls::States, recorder has sls::SimStatus");
}

}  // namespace
}  // namespace sls::doctor
