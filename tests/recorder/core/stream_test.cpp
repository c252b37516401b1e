#include "recorder/core/stream.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "common/bus/convert.hpp"
#include "tests/common/sync/samples.hpp"
#include "tests/recorder/synthetic_run.hpp"

namespace sls::record {
namespace {

using namespace test;
using sync::at;

struct Gap {
  std::uint32_t vehicle_id;
  std::uint64_t from, to;
  bool operator==(const Gap& other) const {
    return vehicle_id == other.vehicle_id && from == other.from && to == other.to;
  }
};

class StreamTest : public testing::Test {
 protected:
  /// The steps handed on so far, of all vehicles.
  std::vector<std::uint64_t> steps() const {
    std::vector<std::uint64_t> list;
    for (const StepRows& row : rows_) list.push_back(row.step);
    return list;
  }
  std::vector<std::uint64_t> list(std::uint64_t from, std::uint64_t to) const {
    std::vector<std::uint64_t> steps;
    for (; from <= to; ++from) steps.push_back(from);
    return steps;
  }
  /// Adds batch `step`, which has only step `step`.
  void add(std::uint64_t step, bool is_last = false) {
    stream_.add(make_batch(step, {make_entry(step)}, is_last), at(0));
  }
  void add_all(std::uint64_t from, std::uint64_t to) {
    for (; from <= to; ++from) add(from);
  }

  Stream make_stream(const Parameters& parameters, std::uint64_t first_step = 0) {
    return Stream(
        parameters, first_step, [this](const StepRows& rows) { rows_.push_back(rows); },
        [this](std::uint32_t id, std::uint64_t from, std::uint64_t to) {
          gaps_.push_back({id, from, to});
        });
  }

  const Parameters parameters_ = make_parameters();
  std::vector<StepRows> rows_;
  std::vector<Gap> gaps_;
  Stream stream_ = make_stream(parameters_);
};

// --- batches -------------------------------------------------------------------------------------

TEST_F(StreamTest, StepsAreHandedOnAtOnce) {
  EXPECT_EQ(stream_.last_step(), -1);
  for (std::uint64_t step = 0; step <= 10; ++step) {
    add(step);
    EXPECT_EQ(stream_.last_step(), static_cast<std::int64_t>(step));
  }
  EXPECT_EQ(steps(), list(0, 10));
  for (const StepRows& rows : rows_) EXPECT_TRUE(rows.is_complete());
  EXPECT_FALSE(stream_.has_ended());
  add(11, true);
  EXPECT_TRUE(stream_.has_ended());
  EXPECT_TRUE(gaps_.empty());
}

TEST_F(StreamTest, BatchesMayComeInAnyOrderAndTwice) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 50; ++trial) {
    rows_.clear();
    Stream stream = make_stream(parameters_);
    std::vector<std::uint64_t> order = list(0, 59);
    std::shuffle(order.begin() + 1, order.end(), random);  // the first batch sets the beginning
    for (const std::uint64_t index : order)
      for (int copy = 0; copy < 2; ++copy)
        stream.add(
            make_batch(index, {make_entry(2 * index), make_entry(2 * index + 1)}, index == 59),
            at(0));
    EXPECT_EQ(steps(), list(0, 119));
    EXPECT_TRUE(stream.has_ended());
    EXPECT_EQ(stream.dropped().repeated, 120u);
  }
  EXPECT_TRUE(gaps_.empty());
}

TEST_F(StreamTest, ABatchAheadOfAMissingOneWaits) {
  add(0);
  add(2);
  add(3);
  EXPECT_EQ(steps(), list(0, 0));
  EXPECT_EQ(stream_.last_step(), 0);
  add(1);
  EXPECT_EQ(steps(), list(0, 3));
  EXPECT_TRUE(gaps_.empty());
}

TEST_F(StreamTest, SixtyFourBatchesWaitForAMissingOneAndNoMore) {
  add(0);
  add_all(2, 65);
  EXPECT_EQ(steps(), list(0, 0));
  add(66);
  EXPECT_EQ(rows_.size(), 66u);
  EXPECT_EQ(gaps_, std::vector<Gap>({{0, 1, 1}}));
  add(1);
  EXPECT_EQ(stream_.dropped().repeated, 1u) << "it comes too late";
  add(67);
  EXPECT_EQ(stream_.last_step(), 67);
}

/// Looks ten times a second.
class MissingBatchTest : public StreamTest {
 protected:
  void add_at(std::int64_t ms, std::uint64_t step) {
    stream_.add(make_batch(step, {make_entry(step)}), at(ms));
  }
  /// Looks until `ms`. The times of the reports.
  std::string look_until(std::int64_t ms) {
    std::string reports;
    for (; now_ <= ms; now_ += 100) {
      stream_.on_time(at(now_));
      if (const auto batch = stream_.take_report(at(now_)))
        reports += std::to_string(now_) + ": " + *batch + "\n";
    }
    return reports;
  }

  std::int64_t now_ = 0;
};

TEST_F(MissingBatchTest, EachBatchInOrderBeginsTheWaitAgain) {
  add_at(0, 0);
  add_at(0, 3);
  add_at(0, 6);
  look_until(9000);
  add_at(9000, 1);
  EXPECT_EQ(look_until(18'900), "10000: batch 2 of sls/record\n15000: batch 2 of sls/record\n");
  EXPECT_EQ(stream_.last_step(), 1);
  add_at(18'900, 8);
  look_until(19'000);
  EXPECT_EQ(stream_.last_step(), 3) << "for batch 4 the wait begins again";
  look_until(28'900);
  EXPECT_EQ(stream_.last_step(), 3);
  look_until(29'000);
  EXPECT_EQ(stream_.last_step(), 8) << "since then nothing has come, so batch 7 is missing, too";
}

TEST_F(StreamTest, HistoryBeforeTheFirstStepOfASegmentIsLeftOut) {
  Stream stream = make_stream(parameters_, 50);
  EXPECT_EQ(stream.last_step(), 49);
  for (std::uint64_t step = 20; step < 60; ++step)
    stream.add(make_batch(step, {make_entry(step)}), at(0));
  EXPECT_EQ(steps(), list(50, 59));
  EXPECT_EQ(stream.dropped().repeated, 30u);
  EXPECT_TRUE(gaps_.empty());
}

TEST_F(StreamTest, SamplesAfterTheLastBatchAreIgnored) {
  add(0, true);
  add(1);
  EXPECT_EQ(steps(), list(0, 0));
  EXPECT_EQ(stream_.dropped().repeated, 1u);
}

TEST_F(StreamTest, GivingUpReturnsTheWaitingBatches) {
  add(0);
  add(2);
  add(5);
  stream_.give_up();
  EXPECT_EQ(steps(), (std::vector<std::uint64_t>{0, 2, 5}));
  EXPECT_EQ(gaps_, std::vector<Gap>({{0, 1, 1}, {0, 3, 4}}));
}

// --- entries -------------------------------------------------------------------------------------

TEST_F(StreamTest, StepsMissingAmidABatchLeaveAGap) {
  stream_.add(make_batch(0, {make_entry(0), make_entry(5), make_entry(3), make_entry(6)}), at(0));
  EXPECT_EQ(steps(), (std::vector<std::uint64_t>{0, 5, 6}));
  EXPECT_EQ(gaps_, std::vector<Gap>({{0, 1, 4}}));
  EXPECT_EQ(stream_.dropped().repeated, 1u);
}

TEST_F(StreamTest, GapsAreOfEachVehicle) {
  Parameters parameters = parameters_;
  set_vehicles(parameters, {0, 7});
  Stream stream = make_stream(parameters);
  stream.add(make_batch(0, {make_entry(0, 0), make_entry(0, 7), make_entry(1, 0)}), at(0));
  EXPECT_EQ(stream.last_step(), 0) << "of vehicle 7";
  stream.add(make_batch(1, {make_entry(2, 7), make_entry(3, 0), make_entry(3, 7)}), at(0));
  EXPECT_EQ(gaps_, std::vector<Gap>({{7, 1, 1}, {0, 2, 2}}));
  EXPECT_EQ(stream.last_step(), 3);
}

TEST_F(StreamTest, StrangeEntriesAreCountedAndLeftOut) {
  RecordEntry unknown = make_entry(1);
  unknown.kind(static_cast<AnswerKind>(7));
  stream_.add(make_batch(0, {make_entry(0), make_entry(1, 4'000'000'000),
                             make_entry(std::numeric_limits<std::uint64_t>::max()), unknown,
                             make_entry(std::numeric_limits<std::int64_t>::max() / 4'000'000 + 1),
                             make_entry(1)}),
              at(0));
  EXPECT_EQ(steps(), list(0, 1));
  EXPECT_EQ(stream_.dropped().out_of_range, 4u);
  EXPECT_TRUE(gaps_.empty());
}

TEST_F(StreamTest, ARefusedAnswerIsRecordedAsItWasSent) {
  RecordEntry entry = make_entry(0);
  entry.kind(AnswerKind::ANSWER_REFUSED);
  entry.answer().fault(FaultCode::FAULT_FREE_FALL);
  entry.answer().f_Q_W_n({1e9, 0, 0});
  stream_.add(make_batch(0, {entry}, true), at(0));
  ASSERT_EQ(rows_.size(), 1u);
  EXPECT_TRUE(rows_[0].is_complete());
  EXPECT_EQ(rows_[0].fault, "free_fall");
  EXPECT_EQ(rows_[0].answer.f_Q_W[0], 1e9);
}

// --- late answers --------------------------------------------------------------------------------

class LateAnswerTest : public StreamTest {
 protected:
  LateAnswerTest() {
    add_all(0, 9);
    stream_.add(make_batch(10, {make_unanswered_entry(10, AnswerKind::ANSWER_HELD)}), at(0));
  }
};

TEST_F(LateAnswerTest, AStepWithoutAnAnswerWaitsForALateOneAndTheOthersWithIt) {
  add_all(11, 20);
  EXPECT_EQ(steps(), list(0, 9));
  stream_.add(make_batch(21, {make_late_entry(10), make_entry(21)}), at(0));
  EXPECT_EQ(steps(), list(0, 21));
  const StepRows& rows = rows_[10];
  EXPECT_EQ(rows.fault, "held");
  EXPECT_EQ(rows.client_name, kPilot);
  EXPECT_EQ(rows.compute_us, 0);
  EXPECT_EQ(bus::to_array(rows.answer.f_Q_W),
            make_unanswered_entry(10, AnswerKind::ANSWER_HELD).answer().f_Q_W_n());
  ASSERT_TRUE(rows.has_reference);
  EXPECT_EQ(bus::to_array(rows.answer.reference.position),
            make_entry(10).answer().reference().position_m());
  EXPECT_EQ(rows.stage_start_step, 0u);
}

// The server stops where a recorder is too far behind. It must not stop for steps that the recorder
// keeps for late answers, which only the server could send.
TEST_F(LateAnswerTest, StepsThatWaitForALateAnswerCountAsReceived) {
  EXPECT_EQ(stream_.last_step(), 10);
  for (std::uint64_t step = 11; step <= 200; ++step) {
    stream_.add(make_batch(step, {make_unanswered_entry(step, AnswerKind::ANSWER_HELD)}), at(0));
    EXPECT_EQ(stream_.last_step(), static_cast<std::int64_t>(step));
  }
  EXPECT_EQ(steps(), list(0, 135)) << "the others are kept for late answers";
  stream_.add(make_batch(202, {make_entry(202)}), at(0));
  EXPECT_EQ(stream_.last_step(), 200) << "a batch is missing";
}

TEST_F(LateAnswerTest, ItIsGivenUpWhenAStepMoreThan64LaterIsIn) {
  add_all(11, 74);
  EXPECT_EQ(steps(), list(0, 9));
  stream_.add(make_batch(75, {make_entry(75)}), at(0));
  EXPECT_EQ(steps(), list(0, 75));
  EXPECT_FALSE(rows_[10].has_reference);
  EXPECT_TRUE(rows_[10].is_whole());
  stream_.add(make_batch(76, {make_late_entry(10)}), at(0));
  EXPECT_EQ(stream_.dropped().repeated, 1u);
}

TEST_F(LateAnswerTest, TheLastBatchOrTheEndOfPatienceEndsTheWaiting) {
  Stream other = make_stream(parameters_);
  stream_.add(make_batch(11, {}, true), at(0));
  EXPECT_EQ(steps(), list(0, 10));
  rows_.clear();
  other.add(make_batch(0, {make_unanswered_entry(0, AnswerKind::ANSWER_FAIL_SAFE)}), at(0));
  EXPECT_TRUE(rows_.empty());
  other.give_up();
  ASSERT_EQ(steps(), list(0, 0));
  EXPECT_EQ(rows_[0].fault, "fail_safe");
}

TEST_F(LateAnswerTest, EachOfSeveralWaitsForItsOwn) {
  stream_.add(make_batch(11, {make_unanswered_entry(11, AnswerKind::ANSWER_FAIL_SAFE)}), at(0));
  stream_.add(make_batch(12, {make_late_entry(11), make_late_entry(11)}), at(0));
  EXPECT_EQ(steps(), list(0, 9));
  EXPECT_EQ(stream_.dropped().repeated, 1u);
  stream_.add(make_batch(13, {make_late_entry(10)}), at(0));
  EXPECT_EQ(steps(), list(0, 11));
  EXPECT_TRUE(rows_[10].is_complete());
  EXPECT_TRUE(rows_[11].is_complete());
}

TEST_F(LateAnswerTest, OfAFleetItBelongsToItsVehicle) {
  Parameters parameters = parameters_;
  set_vehicles(parameters, {0, 1});
  rows_.clear();
  Stream stream = make_stream(parameters);
  const RecordEntry first = make_unanswered_entry(0, AnswerKind::ANSWER_HELD);
  RecordEntry second = first;
  second.vehicle_id(1);
  stream.add(make_batch(0, {first, second, make_late_entry(0, 1)}, true), at(0));
  ASSERT_EQ(rows_.size(), 2u);
  EXPECT_FALSE(rows_[0].has_reference);
  EXPECT_TRUE(rows_[1].has_reference);
}

TEST_F(LateAnswerTest, OnesToStepsThatDidNotGoByWithoutAnAnswerAreDropped) {
  stream_.add(make_batch(11, {make_late_entry(9), make_late_entry(500), make_late_entry(10, 3)}),
              at(0));
  EXPECT_EQ(stream_.dropped().repeated, 2u);
  EXPECT_EQ(stream_.dropped().out_of_range, 1u);
  EXPECT_EQ(steps(), list(0, 9));
}

TEST_F(LateAnswerTest, StepsOutOfOrderTakeBoundedMemory) {
  Parameters parameters = parameters_;
  set_vehicles(parameters, {0, 1});
  rows_.clear();
  Stream stream = make_stream(parameters);
  stream.add(make_batch(0, {make_unanswered_entry(1'000'000, AnswerKind::ANSWER_HELD)}), at(0));
  for (std::uint64_t step = 0; step < 40'000; ++step)
    stream.add(make_batch(step + 1, {make_entry(step, 1)}), at(0));
  EXPECT_GT(rows_.size(), 7'000u);
}

}  // namespace
}  // namespace sls::record
