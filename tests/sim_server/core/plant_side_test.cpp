// From answers to measurements: docs/design.md, sections 6 ("Faults", "Sensing").
#include "sim_server/core/step/plant_side.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <string>

namespace sls::sim {
namespace {

config::Scenario load_short(std::size_t vehicles) {
  auto scenario = config::load_scenario(SLS_SOURCE_DIR "/config/scenarios/short.yaml");
  scenario.vehicles.resize(vehicles);
  return scenario;
}

/// The first vehicles of `scenario` at step 0.
PlantSide begin(const config::Scenario& scenario) {
  std::vector<std::uint32_t> ids(scenario.vehicles.size());
  for (std::uint32_t i = 0; i < ids.size(); ++i) ids[i] = i;
  PlantSide side(scenario, ids, [](std::size_t count, const auto& work) {
    for (std::size_t i = 0; i < count; ++i) work(i);
  });
  side.begin();
  return side;
}

TEST(PlantSideTest, APlantThatFailsIsNamedByItsVehicleIfThereAreSeveral) {
  for (const std::size_t vehicles : {1, 2}) {
    PlantSide side = begin(load_short(vehicles));
    side.records().back().answer.f_Q_W.z() = std::numeric_limits<double>::quiet_NaN();
    const Eigen::Vector3d before = side.records().back().truth.p_WQ;
    try {
      side.advance();
      FAIL();
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(error.what(), std::string(vehicles == 1 ? "" : "vehicle 1: ") +
                                  "force_z_n is not finite after step 0 of the plant");
    }
    EXPECT_EQ(side.records().back().step, 0u);
    EXPECT_EQ(side.records().back().truth.p_WQ, before);
  }
}

TEST(PlantSideTest, AMeasurementOfItsOwnHasOnlyAStepWithErrorsOrFaults) {
  auto scenario = load_short(1);
  EXPECT_FALSE(begin(scenario).records()[0].measured);
  scenario.estimator.position = {1.0, 0.0, 0.0};
  config::BiasFault bias;
  bias.offset.position = {0.0, 2.0, 0.0};
  config::Fault fault;
  fault.effect = bias;
  for (const bool has_fault : {false, true}) {
    if (has_fault) scenario.faults = {fault};
    const model::StepRecord record = begin(scenario).records()[0];
    ASSERT_TRUE(record.measured);
    const double y = has_fault ? 2.0 : 0.0;
    EXPECT_EQ(record.measured->p_WQ, record.truth.p_WQ + Eigen::Vector3d(1.0, y, 0.0));
  }
}

}  // namespace
}  // namespace sls::sim
