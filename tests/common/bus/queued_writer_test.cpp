#include "common/bus/queued_writer.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <mutex>
#include <vector>

#include "tests/support/waiting.hpp"

namespace sls::bus {
namespace {

using sls::test::wait_until;

const std::filesystem::path kQosFile = SLS_SOURCE_DIR "/config/qos/default.xml";
const std::uint64_t kRun = static_cast<std::uint64_t>(::getpid()) * 1000 + 700;

TEST(QueuedWriterTest, WritesInOrderAndFinishesWhatIsQueuedWhenItEnds) {
  constexpr int kDomain = 74;
  Node near(kQosFile, kDomain, "near"), far(kQosFile, kDomain, "far");
  std::mutex mutex;
  std::vector<std::uint64_t> steps;
  Reader<VehicleState> reader(far, kRecorderReaderProfile,
                              [&](const VehicleState& state, const PeerId&) {
                                const std::lock_guard lock(mutex);
                                if (state.run_id() == kRun) steps.push_back(state.step());
                              });
  Writer<VehicleState> writer(near);
  ASSERT_TRUE(wait_until([&] { return writer.matched().count(far.id()) > 0; }));
  constexpr std::uint64_t kCount = 500;
  {
    QueuedWriter<VehicleState> queue(writer, kCount);
    VehicleState state;
    state.run_id(kRun);
    for (std::uint64_t step = 0; step < kCount; ++step) {
      state.step(step);
      queue.write(state);
    }
    EXPECT_EQ(queue.lost(), 0u);
  }
  ASSERT_TRUE(wait_until([&] {
    const std::lock_guard lock(mutex);
    return steps.size() == kCount;
  }));
  for (std::uint64_t step = 0; step < kCount; ++step) EXPECT_EQ(steps[step], step);
}

TEST(QueuedWriterTest, WhatDoesNotFitIsCountedAndNeverBlocks) {
  constexpr int kDomain = 75;
  Node node(kQosFile, kDomain, "near");
  Writer<VehicleState> writer(node);
  QueuedWriter<VehicleState> queue(writer, 0);  // room for nothing
  for (int i = 0; i < 10; ++i) queue.write(VehicleState());
  EXPECT_EQ(queue.lost(), 10u);
}

}  // namespace
}  // namespace sls::bus
