#include "sim_server/plants/slung_load/rigid_links.hpp"

#include <gtest/gtest.h>

#include "common/config/config_error.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim {
namespace {

std::string find_error(const model::SlungLoadParameters& vehicle, const std::string& place = "") {
  return test::find_error<config::ConfigError>([&] { check_rigid_vehicle(vehicle, place); });
}

TEST(RigidLinksTest, AcceptsThePublishedVehicleWithAndWithoutTheRodsMass) {
  EXPECT_EQ(find_error({1.5, 0.2, 1.1, 9.8}), "no error");
  EXPECT_EQ(find_error({1.5, 0.201, 1.1, 9.8066}), "no error");
}

TEST(RigidLinksTest, RefusesOtherMassesAndLengths) {
  EXPECT_EQ(find_error({1.6, 0.2, 1.1, 9.8}),
            "vehicle.quad_mass_kg: expected 1.5 (the rigid pendulum's links bring it), got 1.6");
  EXPECT_EQ(find_error({1.5, 0.16, 1.1, 9.8}),
            "vehicle.load_mass_kg: expected 0.2 or 0.201 (the rigid pendulum's links bring it), "
            "got 0.16");
  EXPECT_EQ(find_error({1.5, 0.2, 1.0, 9.8}, "file:7"),
            "file:7: vehicle.rod_length_m: expected 1.1 (the rigid pendulum's links bring it), "
            "got 1");
}

TEST(RigidLinksTest, InertiasObeyTheTriangleRule) {
  for (const RigidLink& link : {kRigidRod, kRigidLoad}) {
    EXPECT_GE(link.inertia_xx + link.inertia_yy, link.inertia_zz);
    EXPECT_GE(link.inertia_yy + link.inertia_zz, link.inertia_xx);
    EXPECT_GE(link.inertia_zz + link.inertia_xx, link.inertia_yy);
  }
}

}  // namespace
}  // namespace sls::sim
