#include "tools/view/live/page_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "fastcdr_api.hpp"
#include "tests/tools/view/live/binary_message.hpp"
#include "tests/tools/view/live/fake_server.hpp"
#include "tools/view/run_description.hpp"

namespace sls::view {
namespace {

using test::make_batch;
using test::make_entry;
using test::make_parameters;

constexpr std::uint64_t kRun = 0x1234'5678'9abc'def0;

/// `batch` as Fast CDR serialises it, with the header of the encapsulation.
Sample make_sample(const RecordBatch& batch, std::int64_t written_ns = 0) {
  std::vector<std::uint8_t> bytes(200'000);
  eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(bytes.data()), bytes.size());
  bus::Cdr cdr = bus::make_cdr(buffer);
  cdr.serialize_encapsulation();
  bus::write_message(batch, cdr);
  bytes.resize(bus::count_bytes(cdr));
  return {TopicId::kRecord,
          std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes)),
          written_ns,
          {}};
}

std::vector<std::uint32_t> make_ids(std::uint32_t count) {
  std::vector<std::uint32_t> ids;
  for (std::uint32_t id = 0; id < count; ++id) ids.push_back(id);
  return ids;
}

TEST(PageFramesTest, PosesAreTheNewestStepWithEveryFieldInItsPlace) {
  PageFrames frames;
  auto parameters = make_parameters(kRun);
  for (const char* name : {"rotor_1_rad_s", "rotor_2_rad_s", "rotor_1_set_rad_s"})
    parameters.signals().emplace_back().name(name);
  frames.start_run(parameters);
  auto batch = make_batch(kRun, 10, 20);
  batch.entries().back().truth().signals({100, 300, 900});
  batch.entries().back().truth().q_WB({0.5, -0.5, 0.5, -0.5});
  frames.add(make_sample(batch, 1'700'000'000'123'456'789));
  ASSERT_TRUE(frames.decode());
  const auto poses = test::read_poses(frames.make_poses());
  EXPECT_EQ(poses.run_id, kRun);
  EXPECT_EQ(poses.step, 20u);
  EXPECT_DOUBLE_EQ(poses.sim_time_s, 20 * 0.004);
  EXPECT_NEAR(poses.published_ms, 1'700'000'000'123.456, 1e-3);
  ASSERT_EQ(poses.vehicles.size(), 1u);
  const auto& pose = poses.vehicles[0];
  EXPECT_EQ(pose.vehicle_id, 0u);
  EXPECT_EQ(pose.kind, static_cast<std::uint32_t>(AnswerKind::ANSWER_ACCEPTED));
  EXPECT_EQ(pose.quad, (std::vector<float>{20, 2, 3}));
  EXPECT_EQ(pose.attitude, (std::vector<float>{0.5, -0.5, 0.5, -0.5}));
  EXPECT_EQ(pose.load, (std::vector<float>{4, 5, 0}));
  EXPECT_EQ(pose.reference, (std::vector<float>{7, 8, 9}));
  EXPECT_EQ(pose.rotor_rate, 200);
}

TEST(PageFramesTest, PosesOfALoadOnCablesHaveTheirSignals) {
  PageFrames frames;
  auto parameters = make_parameters(kRun, {0}, "slack_drop");
  for (int i = 0; i < 11; ++i)
    parameters.signals().emplace_back().name(i == 10 ? "cable_released" : "other");
  frames.start_run(parameters);
  auto batch = make_batch(kRun, 10, 10);
  batch.entries().back().truth().signals({2.5, 1.5, 1, 0.5, -0.5, 0.5, -0.5, 7, 8, 9, 1});
  frames.add(make_sample(batch));
  ASSERT_TRUE(frames.decode());
  const auto poses = test::read_poses(frames.make_poses(), true);
  EXPECT_EQ(poses.vehicles.at(0).cable, (std::vector<float>{2.5, 1.5, 1, 0.5, -0.5, 0.5, -0.5, 1}));
}

TEST(PageFramesTest, AFleetWhoseStepIsSpreadOverBatchesIsWhole) {
  const auto ids = make_ids(100);
  PageFrames frames;
  frames.start_run(make_parameters(kRun, ids));
  for (std::uint64_t step = 0; step < 20; ++step)
    for (std::uint32_t first = 0; first < 100; first += 25)
      frames.add(make_sample(
          make_batch(kRun, step, step, {ids.begin() + first, ids.begin() + first + 25})));
  ASSERT_TRUE(frames.decode());
  const auto poses = test::read_poses(frames.make_poses());
  ASSERT_EQ(poses.vehicles.size(), 100u);
  EXPECT_EQ(poses.step, 19u);
  for (const auto& pose : poses.vehicles) {
    EXPECT_EQ(pose.quad[0], 19);
    EXPECT_EQ(pose.load[2], static_cast<float>(pose.vehicle_id));
    EXPECT_TRUE(std::isnan(pose.rotor_rate));
  }
}

TEST(PageFramesTest, RowsAreAllStepsSinceTheLastMessageInOrder) {
  PageFrames frames;
  auto parameters = make_parameters(kRun);
  parameters.has_attitude(true);
  parameters.signals().emplace_back().name("a");
  frames.start_run(parameters);
  frames.add(make_sample(make_batch(kRun, 5, 9)));
  frames.add(make_sample(make_batch(kRun, 0, 4)));  // batches may arrive out of order
  ASSERT_TRUE(frames.decode());
  auto rows = test::read_rows(frames.make_rows(0));
  EXPECT_EQ(rows.run_id, kRun);
  ASSERT_EQ(rows.times.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_DOUBLE_EQ(rows.times[i], static_cast<double>(i) * 0.004);
    ASSERT_EQ(rows.rows[i].size(), kColumns.size() + 1);
    EXPECT_EQ(rows.rows[i][0], static_cast<float>(i));
  }
  const auto value = [&](const char* column) {
    const auto place = std::find(kColumns.begin(), kColumns.end(), column);
    return rows.rows[9][static_cast<std::size_t>(place - kColumns.begin())];
  };
  EXPECT_EQ(value("quad_z_m"), 3);
  EXPECT_EQ(value("load_x_m"), 4);
  EXPECT_EQ(value("force_z_n"), -16);
  EXPECT_EQ(value("att_w"), 1);
  EXPECT_EQ(value("ref_z_m"), 9);
  EXPECT_TRUE(std::isnan(rows.rows[9].back())) << "a signal that did not come";

  frames.add(make_sample(make_batch(kRun, 8, 11)));
  ASSERT_TRUE(frames.decode());
  EXPECT_EQ(test::read_rows(frames.make_rows(0)).times.size(), 2u) << "10 and 11 are new";
  frames.add(make_sample(make_batch(kRun, 8, 11)));
  ASSERT_TRUE(frames.decode());
  EXPECT_EQ(frames.make_rows(0), "");
}

TEST(PageFramesTest, ManyRowsAreThinnedAndTheNewestIsAmongThem) {
  PageFrames frames;
  frames.start_run(make_parameters(kRun));
  for (std::uint64_t first = 0; first < 640; first += 64)
    frames.add(make_sample(make_batch(kRun, first, first + 63)));
  ASSERT_TRUE(frames.decode());
  const auto rows = test::read_rows(frames.make_rows(0));
  EXPECT_EQ(rows.times.size(), PageFrames::kMostRows);
  EXPECT_EQ(rows.rows.back()[0], 639);
  EXPECT_TRUE(std::is_sorted(rows.times.begin(), rows.times.end()));
}

TEST(PageFramesTest, AFrameDecodesNoMoreBatchesThanItMayAndTheNewest) {
  PageFrames frames;
  frames.start_run(make_parameters(kRun));
  for (std::uint64_t step = 0; step < 1000; ++step)
    frames.add(make_sample(make_batch(kRun, step, step)));
  ASSERT_TRUE(frames.decode());
  EXPECT_EQ(test::read_poses(frames.make_poses()).step, 999u);
  const auto rows = test::read_rows(frames.make_rows(0));
  EXPECT_EQ(rows.times.size(), PageFrames::kMostRowBatches);
  EXPECT_EQ(rows.rows.back()[0], 999);
}

TEST(PageFramesTest, AReferenceIsThatOfAnAnswerAndOfAHeldOneOnlyDrawn) {
  const auto make_frame = [](AnswerKind kind) {
    PageFrames frames;
    frames.start_run(make_parameters(kRun));
    RecordBatch batch;
    batch.run_id(kRun);
    batch.entries().push_back(make_entry(0, 1, kind));
    frames.add(make_sample(batch));
    EXPECT_TRUE(frames.decode());
    return std::pair(test::read_poses(frames.make_poses()).vehicles.at(0).reference[0],
                     test::read_rows(frames.make_rows(0)).rows.at(0)[kColumns.size() - 3]);
  };
  EXPECT_EQ(make_frame(AnswerKind::ANSWER_ACCEPTED), std::pair(7.f, 7.f));
  EXPECT_EQ(make_frame(AnswerKind::ANSWER_HELD).first, 7);
  EXPECT_TRUE(std::isnan(make_frame(AnswerKind::ANSWER_HELD).second));
  EXPECT_TRUE(std::isnan(make_frame(AnswerKind::ANSWER_NONE).first));
  EXPECT_TRUE(std::isnan(make_frame(AnswerKind::ANSWER_FAIL_SAFE).first));
}

TEST(PageFramesTest, TheStageIsThatOfTheNewestAnswerOfTheLowestVehicle) {
  PageFrames frames;
  frames.start_run(make_parameters(kRun, make_ids(2)));
  const auto decode = [&frames](AnswerKind kind) {
    RecordBatch batch;
    batch.run_id(kRun);
    for (const auto& [id, step, stage] :
         {std::tuple(0u, 1u, "climb"), std::tuple(0u, 2u, "eight"), std::tuple(1u, 2u, "land")}) {
      RecordEntry entry = make_entry(id, step, kind);
      entry.answer().reference().stage_name(stage);
      batch.entries().push_back(entry);
    }
    frames.add(make_sample(batch));
    EXPECT_TRUE(frames.decode());
    return frames.find_stage();
  };
  EXPECT_EQ(decode(AnswerKind::ANSWER_ACCEPTED), "eight");
  EXPECT_EQ(decode(AnswerKind::ANSWER_NONE), "");
}

TEST(PageFramesTest, AnAnswerThatCameLateIsNoState) {
  PageFrames frames;
  frames.start_run(make_parameters(kRun));
  auto batch = make_batch(kRun, 3, 3);
  batch.entries().push_back(make_entry(0, 9, AnswerKind::ANSWER_LATE));
  frames.add(make_sample(batch));
  ASSERT_TRUE(frames.decode());
  EXPECT_EQ(test::read_poses(frames.make_poses()).step, 3u);
  EXPECT_EQ(test::read_rows(frames.make_rows(0)).times.size(), 1u);
}

TEST(PageFramesTest, OtherRunsStrangeVehiclesAndBrokenSamplesAreLeftOut) {
  PageFrames frames;
  frames.start_run(make_parameters(kRun));
  frames.add(make_sample(make_batch(kRun + 1, 1, 2)));
  frames.add(make_sample(make_batch(kRun, 1, 2, {7})));
  Sample broken = make_sample(make_batch(kRun, 1, 2));
  auto bytes = *broken.cdr;
  bytes.resize(bytes.size() / 2);
  broken.cdr = std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
  frames.add(broken);
  EXPECT_FALSE(frames.decode());
  EXPECT_EQ(frames.make_rows(7), "");
  frames.add(make_sample(make_batch(kRun, 4, 4)));
  EXPECT_TRUE(frames.decode());
}

}  // namespace
}  // namespace sls::view
