#include "common/bus/fastdds/guarded_type.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace sls::bus {
namespace {

namespace rtps = eprosima::fastrtps::rtps;

template <class Type, class Message>
bool takes(const std::string& bytes) {
  rtps::SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  GuardedType<Type> type;
  Message message;
  return type.deserialize(&payload, &message);
}

// Found by tests/fuzz: the generated code throws, through the middleware's thread.
TEST(GuardedTypeTest, ASampleOfWrongEncapsulationIsRefused) {
  const std::string bytes(200, 'x');
  EXPECT_FALSE((takes<ControlCommandPubSubType, ControlCommand>(bytes)));
  EXPECT_FALSE((takes<ParametersPubSubType, Parameters>(bytes)));
  EXPECT_FALSE((takes<ParticipantPubSubType, Participant>("")));
}

TEST(GuardedTypeTest, EndlessLengthsAreRefused) {
  for (const char* encapsulation : {"\0\1\0\0", "\0\0\0\0"}) {
    const std::string bytes = std::string(encapsulation, 4) + std::string(600, '\xff');
    EXPECT_FALSE((takes<ParametersPubSubType, Parameters>(bytes)));
    EXPECT_FALSE((takes<SimStatusPubSubType, SimStatus>(bytes)));
    EXPECT_FALSE((takes<ReferencePubSubType, Reference>(bytes)));
  }
}

TEST(GuardedTypeTest, WhatIsLongerThanAnySampleIsRefusedBeforeItsElementsAreMade) {
  // run_id, step and a count of vehicles, each of which would be half a kilobyte, and bytes enough.
  std::string bytes("\0\1\0\0", 4);
  bytes += std::string(16, '\0') + std::string("\x40\x42\x0f\0", 4);  // 1,000,000
  bytes += std::string(2'000'000, '\0');
  EXPECT_FALSE((takes<FleetStatePubSubType, FleetState>(bytes)));
  EXPECT_FALSE((takes<FleetCommandPubSubType, FleetCommand>(bytes)));
  EXPECT_FALSE((takes<FleetReferencePubSubType, FleetReference>(bytes)));
}

// Found by tests/fuzz: sequences of strings are made before a look at how long the sample is.
TEST(GuardedTypeTest, AShortStatusThatClaimsBillionsOfNamesIsRefused) {
  std::string bytes("\0\1\0\0", 4);  // encapsulation; offsets below count from its end
  bytes += std::string(28, '\0');    // run_id, vehicle_id, sample_index, phase
  bytes +=
      std::string("\1\0\0\0\0", 5) + std::string(7, '\0');  // reason, to the next multiple of 8
  bytes += std::string(8, '\0');                            // step
  bytes += std::string("\1\0\0\0\0", 5) + std::string(3, '\0');  // controller_name
  bytes += std::string("\xff\xff\xff\x7f", 4);                   // of controller_names
  bytes += std::string(500, '\0');
  EXPECT_FALSE((takes<SimStatusPubSubType, SimStatus>(bytes)));
}

TEST(GuardedTypeTest, RandomBytesThrowNothing) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 20000; ++i) {
    std::string bytes(random() % 800, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    if (bytes.size() >= 4 && i % 2) std::copy_n("\0\1\0\0", 4, bytes.begin());
    EXPECT_NO_THROW((takes<ParametersPubSubType, Parameters>(bytes)));
    EXPECT_NO_THROW((takes<ParticipantPubSubType, Participant>(bytes)));
    EXPECT_NO_THROW((takes<SimControlPubSubType, SimControl>(bytes)));
  }
}

}  // namespace
}  // namespace sls::bus
