#include "tools/view/live/sample_queue.hpp"

#include <gtest/gtest.h>

#include <string>
#include <thread>

namespace sls::view {
namespace {

using namespace std::chrono_literals;

/// A sample with `number` as its `written_ns`.
Sample make_sample(TopicId topic, std::int64_t number, std::size_t bytes = 10) {
  return {topic, std::make_shared<const std::vector<std::uint8_t>>(bytes), number, {}};
}

std::string list(const std::vector<Sample>& samples) {
  std::string numbers;
  for (const Sample& sample : samples) numbers += std::to_string(sample.written_ns) + " ";
  return numbers;
}

TEST(SampleQueueTest, TheFirstSampleIsAnnouncedAtOnceAndTheNextNotUntilAllAreTaken) {
  SampleQueue queue(1000);
  EXPECT_TRUE(queue.put(make_sample(TopicId::kRecord, 1)));
  EXPECT_FALSE(queue.put(make_sample(TopicId::kRecord, 2)));
  std::this_thread::sleep_until(SampleQueue::Clock::now() + SampleQueue::kPeriod);
  EXPECT_FALSE(queue.put(make_sample(TopicId::kRecord, 3)));
  EXPECT_EQ(list(queue.take_all()), "1 2 3 ");
  EXPECT_EQ(list(queue.take_all()), "");
}

TEST(SampleQueueTest, AnEarlySampleIsDueAfterThePeriod) {
  SampleQueue queue(1000);
  const auto announced = SampleQueue::Clock::now();
  ASSERT_TRUE(queue.put(make_sample(TopicId::kRecord, 1)));
  queue.take_all();
  queue.set_period(1h);
  EXPECT_FALSE(queue.put(make_sample(TopicId::kRecord, 2)));
  EXPECT_FALSE(queue.wait_until_due(SampleQueue::Clock::now()));
  queue.set_period(200ms);
  EXPECT_TRUE(queue.wait_until_due(announced + 1h));
  EXPECT_GE(SampleQueue::Clock::now(), announced + 200ms);
  EXPECT_FALSE(queue.wait_until_due(SampleQueue::Clock::now())) << "announced already";
  EXPECT_EQ(list(queue.take_all()), "2 ");
}

TEST(SampleQueueTest, AnInterruptEndsTheWait) {
  SampleQueue queue(1000);
  std::thread interrupting([&] { queue.interrupt(); });
  EXPECT_FALSE(queue.wait_until_due(SampleQueue::Clock::now() + 60s));
  interrupting.join();
}

TEST(SampleQueueTest, BeyondItsBoundTheOldestOfTheLoopAreDroppedAndNoLatchedOne) {
  SampleQueue queue(35);
  queue.put(make_sample(TopicId::kStatus, 1));
  for (int i = 2; i <= 5; ++i) queue.put(make_sample(TopicId::kState, i));
  EXPECT_EQ(list(queue.take_all()), "1 4 5 ");
  EXPECT_EQ(queue.dropped(), 2u);
}

TEST(SampleQueueTest, AFloodOfLatchedSamplesIsBoundedToo) {
  SampleQueue queue(35);
  for (int i = 1; i <= 1000; ++i) queue.put(make_sample(TopicId::kParticipant, i));
  EXPECT_EQ(list(queue.take_all()), "998 999 1000 ");
}

}  // namespace
}  // namespace sls::view
