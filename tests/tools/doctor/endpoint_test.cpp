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
};

TEST_F(EndpointTest, AMismatchNamesOfferedAndRequestedValue) {
  reader_.is_reliable = true;
  EXPECT_EQ(find_policy_mismatches({writer_, reader_}).front().text,
            "RELIABILITY: offered best effort, asked reliable (sim_server, recorder)");
  writer_.is_reliable = true;
  EXPECT_TRUE(find_policy_mismatches({writer_, reader_}).empty());
}

TEST_F(EndpointTest, OnlyEndpointsOfOneTopicAndTwoParticipantsAreCompared) {
  reader_.is_reliable = true;
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
