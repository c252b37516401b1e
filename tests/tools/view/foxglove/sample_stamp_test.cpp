#include "tools/view/foxglove/sample_stamp.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/tools/view/foxglove/fakes.hpp"

namespace sls::view::foxglove {
namespace {

using test::Endianness;
using test::to_cdr;

class SampleStampTest : public ::testing::TestWithParam<Endianness> {
 protected:
  template <class Message>
  std::optional<SampleStamp> read(TopicId topic, Message message) {
    message.run_id(0x0123456789abcdef);
    const auto stamp = read_stamp(topic, to_cdr(message, GetParam()));
    EXPECT_EQ(stamp.value().run_id, 0x0123456789abcdefU);
    return stamp;
  }
};

INSTANTIATE_TEST_SUITE_P(Both, SampleStampTest,
                         ::testing::Values(Endianness::LITTLE_ENDIANNESS,
                                           Endianness::BIG_ENDIANNESS));

TEST_P(SampleStampTest, OfStatesHasStepAndTime) {
  States states;
  states.step(0x1122334455);
  states.sim_time_ns(987'654'321'000);
  const auto stamp = read(TopicId::kState, states);
  EXPECT_EQ(stamp->step, 0x1122334455U);
  EXPECT_EQ(stamp->sim_time_ns, 987'654'321'000);
}

TEST_P(SampleStampTest, OfCommandsHasStep) {
  Commands commands;
  commands.step(77);
  EXPECT_EQ(read(TopicId::kCommand, commands)->step, 77U);
}

TEST_P(SampleStampTest, OfABatchHasTheStepOfTheFirstEntry) {
  RecordBatch batch;
  batch.batch_index(9);
  batch.is_last(true);
  EXPECT_FALSE(read(TopicId::kRecord, batch)->step);
  batch.entries().resize(2);
  batch.entries()[0].vehicle_id(3);
  batch.entries()[0].step(78);
  batch.entries()[1].step(79);
  EXPECT_EQ(read(TopicId::kRecord, batch)->step, 78U);
}

TEST_P(SampleStampTest, StepsBehindTextsOfAnyLengthAreFound) {
  for (std::size_t length = 0; length < 20; ++length) {
    SimStatus status;
    status.phase(RunPhase::PHASE_PAUSED);
    status.reason(std::string(length, 'x'));
    status.step(4711);
    EXPECT_EQ(read(TopicId::kStatus, status)->step, 4711U) << length;
    SimControlReply reply;
    reply.accepted(true);
    reply.reason(std::string(length, 'x'));
    reply.step(4712);
    EXPECT_EQ(read(TopicId::kControlReply, reply)->step, 4712U) << length;
  }
}

TEST_P(SampleStampTest, OtherTopicsHaveTheRunAlone) {
  EXPECT_FALSE(read(TopicId::kParameters, Parameters())->step);
  EXPECT_FALSE(read(TopicId::kParticipant, Participant())->step);
  EXPECT_FALSE(read(TopicId::kControl, SimControl())->step);
}

TEST_P(SampleStampTest, ACutSampleHasNoMoreThanItHolds) {
  SimStatus status;
  status.reason("who is missing");
  const auto cdr = to_cdr(status, GetParam());
  for (std::size_t size = 0; size < cdr.size(); ++size)
    for (std::size_t topic = 0; topic < kTopics; ++topic) {
      const auto stamp =
          read_stamp(static_cast<TopicId>(topic), {cdr.begin(), cdr.begin() + long(size)});
      EXPECT_EQ(stamp.has_value(), size >= 12) << size;
    }
}

TEST(CalcSimTimeTest, NeverOverflows) {
  constexpr std::int64_t kMost = 2'147'483'647'000'000'000;
  EXPECT_EQ(calc_sim_time(250, 4'000'000), 1'000'000'000);
  EXPECT_EQ(calc_sim_time(std::numeric_limits<std::uint64_t>::max(), 4'000'000), kMost);
  EXPECT_EQ(calc_sim_time(5, 0), 0);
  EXPECT_EQ(calc_sim_time(5, -4), 0);
}

}  // namespace
}  // namespace sls::view::foxglove
