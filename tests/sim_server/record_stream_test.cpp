// Entries for recorders arrive complete and in order, in batches within their limits.
#include "sim_server/record_stream.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "common/bus/qos_file.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/waiting.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kRun = 0xfeed;

class RecordStreamTest : public testing::Test {
 protected:
  void begin(std::size_t max_bytes) {
    stream_ = std::make_unique<RecordStream>(writer_, max_bytes, kRun);
    ASSERT_TRUE(test::wait_until([&] { return !reader_.matched().empty(); }));
  }

  /// Collects a step of `vehicles` vehicles.
  void add(std::uint64_t step, std::size_t vehicles = 1, std::size_t numbers = 0) {
    std::vector<model::StepRecord> records(vehicles);
    for (std::size_t i = 0; i < vehicles; ++i) {
      records[i].vehicle_id = static_cast<std::uint32_t>(i);
      records[i].step = step;
      records[i].answer.memory.numbers.setOnes(static_cast<Eigen::Index>(numbers));
    }
    stream_->add_step(records);
  }

  std::vector<RecordBatch> batches() {
    const std::lock_guard lock(mutex_);
    return batches_;
  }

  std::size_t count_entries() {
    std::size_t entries = 0;
    for (const RecordBatch& batch : batches()) entries += batch.entries().size();
    return entries;
  }

  bool wait_for_last() {
    return test::wait_until([&] {
      const auto all = batches();
      return !all.empty() && all.back().is_last();
    });
  }

  /// Expects steps and vehicles in order, batches counted from 0, and only the last batch marked.
  void expect_whole(std::uint64_t steps, std::uint32_t vehicles) {
    std::uint64_t step = 0;
    std::uint32_t vehicle = 0;
    const auto all = batches();
    for (std::size_t i = 0; i < all.size(); ++i) {
      EXPECT_EQ(all[i].run_id(), kRun);
      EXPECT_EQ(all[i].batch_index(), i);
      EXPECT_EQ(all[i].is_last(), i + 1 == all.size());
      for (const RecordEntry& entry : all[i].entries()) {
        ASSERT_EQ(entry.step(), step);
        ASSERT_EQ(entry.vehicle_id(), vehicle);
        if (++vehicle == vehicles) vehicle = 0, ++step;
      }
    }
    EXPECT_EQ(step, steps);
    EXPECT_EQ(stream_->lost(), 0u);
  }

  test::OwnDomain domain_;
  bus::Node node_{bus::default_qos_file(), domain_.number(), "test"};
  bus::Writer<RecordBatch> writer_{node_};
  std::mutex mutex_;
  std::vector<RecordBatch> batches_;
  bus::Reader<RecordBatch> reader_{node_, bus::kRecordReaderProfile,
                                   [this](const RecordBatch& batch, const bus::PeerId&) {
                                     const std::lock_guard lock(mutex_);
                                     batches_.push_back(batch);
                                   }};
  std::unique_ptr<RecordStream> stream_;
};

TEST_F(RecordStreamTest, AllStepsArriveInOrderAndTheLastBatchIsMarked) {
  begin(12'000);
  for (std::uint64_t step = 0; step < 5000; ++step) add(step);
  stream_->end();
  ASSERT_TRUE(wait_for_last());
  expect_whole(5000, 1);
  EXPECT_LE(batches().size(), 5000 / 10u) << "samples per step: at most 0.1";
}

TEST_F(RecordStreamTest, NoBatchIsLargerThanTheLimit) {
  begin(1'400);
  for (std::uint64_t step = 0; step < 100; ++step) add(step, 7);
  stream_->end();
  ASSERT_TRUE(wait_for_last());
  expect_whole(100, 7);
  for (const RecordBatch& batch : batches()) EXPECT_LE(bus::calc_size(batch), 1'400u);
}

TEST_F(RecordStreamTest, AnEntryThatIsLargerThanTheLimitIsABatchOfItsOwn) {
  begin(600);
  for (std::uint64_t step = 0; step < 10; ++step) add(step, 2, MOST_NUMBERS);
  stream_->end();
  ASSERT_TRUE(wait_for_last());
  expect_whole(10, 2);
  EXPECT_EQ(batches().front().entries().size(), 1u);
}

TEST_F(RecordStreamTest, NoBatchHoldsMoreEntriesThanItsTypeAllows) {
  begin(60'000);
  for (std::uint64_t step = 0; step < 20; ++step) add(step, 100);
  stream_->end();
  ASSERT_TRUE(wait_for_last());
  expect_whole(20, 100);
}

TEST_F(RecordStreamTest, AStepIsWrittenSoonAlsoWhereNoneFollows) {
  begin(12'000);
  add(0);
  EXPECT_TRUE(test::wait_until([&] { return count_entries() == 1; }));
}

TEST_F(RecordStreamTest, ARunWithoutStepsHasALastBatch) {
  begin(12'000);
  stream_->end();
  ASSERT_TRUE(wait_for_last());
  EXPECT_EQ(count_entries(), 0u);
}

TEST_F(RecordStreamTest, TheHistoryHoldsFewerStepsWhereEachTakesSeveralBatches) {
  begin(12'000);
  EXPECT_EQ(stream_->history_steps(), 5000u);
  for (std::uint64_t step = 0; step < 3; ++step) add(step, 100);
  stream_->end();
  std::size_t bytes_of_step = 0;
  ASSERT_TRUE(wait_for_last());
  for (const RecordBatch& batch : batches())
    for (const RecordEntry& entry : batch.entries())
      if (entry.step() == 0) bytes_of_step += bus::calc_size(entry);
  const std::uint64_t batches_of_step = (bytes_of_step + 11'999) / 12'000;
  EXPECT_GE(batches_of_step, 3u);
  EXPECT_EQ(stream_->history_steps(), 5000 / batches_of_step);
}

TEST_F(RecordStreamTest, EntriesThatDoNotFitAreCounted) {
  begin(12'000);
  for (std::uint64_t step = 0; step < 100; ++step) add(step, 1000);
  const std::uint64_t lost = stream_->lost();
  stream_->end();
  ASSERT_TRUE(wait_for_last());
  EXPECT_EQ(count_entries() + lost, 100'000u);
  add(100);
  EXPECT_EQ(stream_->lost(), lost + 1) << "the run has ended";
}

}  // namespace
}  // namespace sls::sim
