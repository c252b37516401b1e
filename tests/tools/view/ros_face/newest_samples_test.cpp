#include "tools/view/ros_face/newest_samples.hpp"

#include <gtest/gtest.h>

#include "common/bus/names.hpp"
#include "fastcdr_api.hpp"

namespace sls::view {
namespace {

constexpr std::uint64_t kRun = 42;

Parameters make_parameters(const std::vector<std::uint32_t>& vehicle_ids) {
  Parameters parameters;
  parameters.run_id(kRun);
  parameters.period_ns(4'000'000);
  for (const std::uint32_t id : vehicle_ids) parameters.vehicles().emplace_back().vehicle_id(id);
  return parameters;
}

/// An entry whose numbers all depend on vehicle and step.
RecordEntry make_entry(std::uint32_t vehicle_id, std::uint64_t step,
                       AnswerKind kind = AnswerKind::ANSWER_ACCEPTED) {
  const double number = 1000.0 * vehicle_id + static_cast<double>(step);
  RecordEntry entry;
  entry.vehicle_id(vehicle_id);
  entry.step(step);
  entry.kind(kind);
  entry.truth().p_WQ_m({number, 1, 2});
  entry.truth().v_WQ_m_s({number, 3, 4});
  entry.truth().q_WB({1, 0, 0, 0});
  entry.truth().w_WB_B_rad_s({number, 5, 6});
  entry.truth().p_WL_m({number, 7, 8});
  entry.truth().v_WL_m_s({number, 9, 10});
  entry.answer().reference().position_m({number, 11, 12});
  return entry;
}

Bytes serialize(const std::vector<RecordEntry>& entries, std::uint64_t run_id = kRun) {
  RecordBatch batch;
  batch.run_id(run_id);
  batch.entries(entries);
  auto bytes = std::make_shared<std::vector<std::uint8_t>>(100'000);
  eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(bytes->data()), bytes->size());
  bus::Cdr cdr = bus::make_cdr(buffer, bus::Cdr::LITTLE_ENDIANNESS);
  cdr.serialize_encapsulation();
  bus::write_message(batch, cdr);
  bytes->resize(bus::count_bytes(cdr));
  return bytes;
}

using Steps = std::vector<std::pair<std::uint32_t, std::uint64_t>>;
Steps list_steps(const std::vector<ros::VehicleSample>& samples) {
  Steps steps;
  for (const ros::VehicleSample& sample : samples)
    steps.emplace_back(sample.vehicle_id, sample.step);
  return steps;
}

TEST(NewestSamplesTest, AreTheLastStatesOfEachVehicleThatAreNew) {
  NewestSamples newest(make_parameters({0, 3}));
  const Bytes first = serialize({make_entry(0, 7), make_entry(3, 7), make_entry(0, 8)});
  EXPECT_EQ(list_steps(newest.take({first})), (Steps{{0, 8}, {3, 7}}));
  EXPECT_EQ(list_steps(newest.take({first})), Steps());
  EXPECT_EQ(list_steps(newest.take({first, serialize({make_entry(3, 8)})})), (Steps{{3, 8}}));
  EXPECT_EQ(list_steps(newest.take({serialize({make_entry(0, 9)}), serialize({make_entry(3, 9)})})),
            (Steps{{0, 9}, {3, 9}}));
}

TEST(NewestSamplesTest, HoldTheNumbersOfTheStep) {
  NewestSamples newest(make_parameters({2}));
  const auto samples = newest.take({serialize({make_entry(2, 25)})});
  ASSERT_EQ(samples.size(), 1U);
  const ros::VehicleSample& sample = samples[0];
  EXPECT_EQ(sample.sim_time_ns, 100'000'000);
  EXPECT_EQ(sample.p_WQ, Eigen::Vector3d(2025, 1, 2));
  EXPECT_EQ(sample.v_WQ, Eigen::Vector3d(2025, 3, 4));
  EXPECT_EQ(sample.w_WB_B, Eigen::Vector3d(2025, 5, 6));
  EXPECT_EQ(sample.p_WL, Eigen::Vector3d(2025, 7, 8));
  EXPECT_EQ(sample.v_WL, Eigen::Vector3d(2025, 9, 10));
  EXPECT_EQ(sample.reference, Eigen::Vector3d(2025, 11, 12));
}

TEST(NewestSamplesTest, HaveNoReferenceWhereTheAnswerIsOfAnotherStep) {
  for (const AnswerKind kind : {AnswerKind::ANSWER_NONE, AnswerKind::ANSWER_HELD,
                                AnswerKind::ANSWER_FAIL_SAFE, AnswerKind::ANSWER_REFUSED}) {
    NewestSamples newest(make_parameters({0}));
    const auto samples = newest.take({serialize({make_entry(0, 1, kind)})});
    ASSERT_EQ(samples.size(), 1U);
    EXPECT_FALSE(samples[0].reference) << bus::to_number(kind);
  }
}

TEST(NewestSamplesTest, LateAnswersAreNoStates) {
  NewestSamples newest(make_parameters({0}));
  const Bytes batch = serialize({make_entry(0, 5), make_entry(0, 4, AnswerKind::ANSWER_LATE)});
  EXPECT_EQ(list_steps(newest.take({batch})), (Steps{{0, 5}}));
}

TEST(NewestSamplesTest, OtherRunsOtherVehiclesAndOtherBytesAreIgnored) {
  NewestSamples newest(make_parameters({0}));
  const auto noise = std::make_shared<std::vector<std::uint8_t>>(100, 0xff);
  const auto nothing = std::make_shared<std::vector<std::uint8_t>>();
  EXPECT_EQ(list_steps(newest.take({serialize({make_entry(0, 5)}, kRun + 1), noise, nothing,
                                    serialize({make_entry(1, 5)})})),
            Steps());
}

}  // namespace
}  // namespace sls::view
