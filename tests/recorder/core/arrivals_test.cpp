#include "recorder/core/arrivals.hpp"

#include <gtest/gtest.h>

#include <variant>
#include <vector>

#include "tests/common/sync/samples.hpp"

namespace sls::record {
namespace {

using namespace sync;

constexpr auto kItsServer = peer(2), kStranger = peer(3);

class ArrivalsTest : public testing::Test {
 protected:
  void put(std::uint64_t run_id, std::uint64_t sample_index,
           const bus::PeerId& sender = kItsServer) {
    SimStatus sample = status(run_id, RunPhase::PHASE_RUNNING);
    sample.sample_index(sample_index);
    arrivals_.put({run_id, sender, sample});
  }
  /// A batch with so many entries.
  void put_batch(std::uint64_t run_id, std::size_t entries) {
    RecordBatch batch;
    batch.run_id(run_id);
    batch.entries().resize(entries);
    arrivals_.put({run_id, kItsServer, batch});
  }
  std::vector<std::uint64_t> take() {
    std::vector<std::uint64_t> indices;
    for (const Arrivals::Sample& sample : arrivals_.take_all())
      indices.push_back(std::get<SimStatus>(sample).sample_index());
    return indices;
  }

  using Indices = std::vector<std::uint64_t>;
  Arrivals arrivals_{[](std::uint64_t run_id) { return run_id != kLowerRun; }};
};

TEST_F(ArrivalsTest, SamplesWaitForTheirRunToBeOpened) {
  put(kRun, 0);
  put(kLowerRun, 1);  // no run of ours
  put(kRun + 1, 2);
  EXPECT_EQ(take(), Indices());
  arrivals_.open(kRun, kItsServer);
  put(kRun, 3);
  EXPECT_EQ(take(), (Indices{0, 3}));
  EXPECT_EQ(take(), Indices()) << "once";
  arrivals_.open(kRun + 1, kItsServer);
  EXPECT_EQ(take(), Indices{2});
}

TEST_F(ArrivalsTest, OnlyTheServerOfTheRunIsHeard) {
  put(kRun, 0, kStranger);
  arrivals_.open(kRun, kItsServer);
  put(kRun, 1, kStranger);
  put(kRun, 2);
  EXPECT_EQ(take(), Indices{2});
}

TEST_F(ArrivalsTest, ARunThatWasOpenIsOver) {
  arrivals_.open(kRun, kItsServer);
  put(kRun, 0);
  arrivals_.open(kRun + 1, kItsServer);
  EXPECT_EQ(take(), Indices());
  put(kRun, 1);
  arrivals_.open(kRun, kItsServer);
  EXPECT_EQ(take(), Indices());
}

TEST_F(ArrivalsTest, SamplesOfTheOpenRunWithoutRoomAreCounted) {
  arrivals_.open(kRun, kItsServer);
  put_batch(kRun, Arrivals::kMostEntries - 1);
  put_batch(kRun, 0);  // counts as one
  EXPECT_EQ(arrivals_.refused(), 0u);
  put_batch(kRun, 3);
  EXPECT_EQ(arrivals_.refused(), 3u);
  EXPECT_EQ(arrivals_.take_all().size(), 2u);
  put_batch(kRun, 3);
  EXPECT_EQ(arrivals_.take_all().size(), 1u) << "there is room again";
}

TEST_F(ArrivalsTest, OfWaitingRunsTheOldestSamplesAreDropped) {
  put_batch(kRun, 2);
  put_batch(kRun, Arrivals::kMostEntries - 1);
  arrivals_.open(kRun, kItsServer);
  EXPECT_EQ(arrivals_.take_all().size(), 1u);
  EXPECT_EQ(arrivals_.refused(), 0u) << "the recording lists them as missing";
}

}  // namespace
}  // namespace sls::record
