// The key `vehicles`, and the scenario of one vehicle.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "tests/common/config/support.hpp"

namespace sls::config::test {
namespace {

using Eigen::Vector3d;

/// Every kind of stage, and different vehicles; defaults for all other keys.
constexpr const char* kFleet = R"(name: fleet
vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }
vehicles:
  - {}
  - { offset_m: [10, -20, 0.5], quad_mass_kg: 2, load_mass_kg: 0.3, rod_length_m: 0.7 }
plant:
  initial: { load_position_m: [1, 2, -0.5] }
mission:
  - hold: { position_m: [1, 2, -0.5] }
    for_s: 1
  - set_point: { position_m: [0, 0, -1] }
    until: { within_m: 0.2, offset_m: [0, 0, 0.1] }
  - figure_eight: { amplitude_m: [1.5, 0.75, 0.5], offset_m: [0, 0, -0.5], period_s: 16 }
    for_s: 32
  - rest_to_rest: { from_m: [0, 0, -1], to_m: [1, 0, -1], duration_s: 4 }
    for_s: 4
faults:
  - freeze: { on: state, vehicle: 1, from_s: 1, to_s: 2 }
)";

Scenario parse_fleet(const std::string& line) {
  return parse_scenario(std::string(kMinimalScenario) + line + "\n", "file");
}

TEST(FleetTest, ANumberOfVehiclesIsALevelSquareGridAlongXFirst) {
  const auto vehicles = parse_fleet("vehicles: 5").vehicles;
  const Vector3d expected[] = {{0, 0, 0}, {5, 0, 0}, {10, 0, 0}, {0, 5, 0}, {5, 5, 0}};
  ASSERT_EQ(vehicles.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(vehicles[i].offset, expected[i]) << i;
    EXPECT_FALSE(vehicles[i].quad_mass || vehicles[i].load_mass || vehicles[i].rod_length);
  }
}

TEST(FleetTest, AnyNumberFromOneToTheBoundKeepsVehiclesFiveMetresApart) {
  for (std::size_t count = 1; count <= kMaxVehicles; ++count) {
    const auto vehicles = parse_fleet("vehicles: " + std::to_string(count)).vehicles;
    ASSERT_EQ(vehicles.size(), count);
    EXPECT_EQ(vehicles[0].offset, Vector3d(0, 0, 0));
    const double side = std::ceil(std::sqrt(static_cast<double>(count)));
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_LE(vehicles[i].offset.maxCoeff(), 5.0 * (side - 1));
      for (std::size_t j = 0; j < i; ++j)
        ASSERT_GE((vehicles[i].offset - vehicles[j].offset).norm(), 5.0) << count;
    }
  }
}

TEST(FleetTest, AVehicleHasItsOwnParametersAndTheOthersOfAll) {
  const Scenario fleet = parse_scenario(kFleet, "file");
  EXPECT_EQ(make_vehicle_scenario(fleet, 0).vehicle, fleet.vehicle);
  EXPECT_EQ(make_vehicle_scenario(fleet, 1).vehicle,
            (model::SlungLoadParameters{2.0, 0.3, 0.7, 9.8}));
}

TEST(FleetTest, EveryPlaceOfAVehicleMovesByItsOffset) {
  const Scenario fleet = parse_scenario(kFleet, "file");
  const Scenario alone = make_vehicle_scenario(fleet, 1);
  const Vector3d offset(10, -20, 0.5);
  EXPECT_EQ(alone.plant.initial.position, Vector3d(11, -18, 0));
  ASSERT_EQ(alone.mission.size(), 4u);
  for (const std::size_t i : {0, 1})
    EXPECT_EQ(std::get<ConstantReference>(alone.mission[i].reference).position,
              std::get<ConstantReference>(fleet.mission[i].reference).position + offset);
  const auto& eight = std::get<FigureEightReference>(alone.mission[2].reference);
  EXPECT_EQ(eight.offset, Vector3d(10, -20, 0));
  EXPECT_EQ(eight.amplitude, Vector3d(1.5, 0.75, 0.5));
  const auto& rest = std::get<RestToRestReference>(alone.mission[3].reference);
  EXPECT_EQ(rest.from, Vector3d(10, -20, -0.5));
  EXPECT_EQ(rest.to, Vector3d(11, -20, -0.5));
  // The offset is relative to the reference, which moved with the vehicle.
  EXPECT_EQ(std::get<LeaveUntil>(alone.mission[1].leave).offset, Vector3d(0, 0, 0.1));
}

TEST(FleetTest, AVehicleAloneKeepsNameTextHashAndFaults) {
  const Scenario fleet = parse_scenario(kFleet, "file");
  const Scenario alone = make_vehicle_scenario(fleet, 1);
  EXPECT_EQ(alone.name, fleet.name);
  EXPECT_EQ(alone.text, fleet.text);
  EXPECT_EQ(alone.sha256, fleet.sha256);
  ASSERT_EQ(alone.faults.size(), 1u);
  EXPECT_EQ(alone.faults[0].vehicle, 1);
  ASSERT_EQ(alone.vehicles.size(), 1u);
  EXPECT_TRUE(are_equal(make_vehicle_scenario(alone, 0), alone));
  EXPECT_THROW(make_vehicle_scenario(alone, 1), std::out_of_range);
}

TEST(FleetTest, AVehicleWithoutOwnKeysFliesThePlainScenarioBitForBit) {
  const std::string text =
      replace_once(kMinimalScenario, "[0, 0, -0.5] }\nmission", "[-0.0, -0.0, -0.5] }\nmission");
  const Scenario plain = parse_scenario(text, "file");
  const Scenario alone = make_vehicle_scenario(parse_scenario(text + "vehicles: 9", "file"), 0);
  EXPECT_TRUE(are_equal(alone, plain));
  EXPECT_TRUE(std::signbit(alone.plant.initial.position.x()));
  EXPECT_EQ(to_yaml(alone), to_yaml(plain));
}

TEST(FleetTest, TheModelFollowsEachVehicleUnlessTheFileSaysOtherwise) {
  const Scenario silent = parse_scenario(kFleet, "file");
  EXPECT_EQ(make_vehicle_scenario(silent, 0).controller.model.vehicle, silent.vehicle);
  EXPECT_EQ(make_vehicle_scenario(silent, 1).controller.model.vehicle,
            (model::SlungLoadParameters{2.0, 0.3, 0.7, 9.8}));

  // An explicit value stays, even if it equals the value of `vehicle`.
  const Scenario explicit_model = parse_scenario(
      std::string(kFleet) + "controller: { model: { load_mass_kg: 0.2, gravity_m_s2: 9.7 } }\n",
      "file");
  EXPECT_EQ(make_vehicle_scenario(explicit_model, 0).controller.model.vehicle,
            (model::SlungLoadParameters{1.5, 0.2, 1.0, 9.7}));
  EXPECT_EQ(make_vehicle_scenario(explicit_model, 1).controller.model.vehicle,
            (model::SlungLoadParameters{2.0, 0.2, 0.7, 9.7}));
}

TEST(FleetTest, AVehicleAloneWrittenAndReadIsEqual) {
  Scenario fleet = parse_scenario(kFleet, "file");
  fleet.faults.clear();  // they refer to the fleet
  for (const std::uint32_t id : {0u, 1u}) {
    const Scenario alone = make_vehicle_scenario(fleet, id);
    EXPECT_TRUE(are_equal(parse_scenario(to_yaml(alone), "file"), alone)) << to_yaml(alone);
  }
}

}  // namespace
}  // namespace sls::config::test
