// Adds a law to the lists of models and flies it.
#include <gtest/gtest.h>

#include <string>

#include "closed_loop/flight.hpp"
#include "tests/support/errors.hpp"

namespace sls {
namespace {

config::Scenario parse(const std::string& controller) {
  return config::parse_scenario(
      "name: added\n"
      "vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1, gravity_m_s2: 9.8 }\n"
      "plant: { model: analytic, initial: { load_position_m: [0, 0, -1] } }\n"
      "controller: " +
          controller +
          "\n"
          "mission: [{ hold: { position_m: [0, 0, -1] }, for_s: 2 }]\n",
      "added");
}

std::string find_error(const std::string& controller) {
  return test::find_error<config::ConfigError>([&] { parse(controller); });
}

/// Free fall with g (1 − share): both masses move alike, since the rod is vertical.
TEST(AddedModelTest, ALawIsItsSourcesAndALineInTheList) {
  for (const double share : {1.0, 0.5}) {
    const auto steps =
        closed_loop::fly(parse("{ law: steady, share: " + std::to_string(share) + " }"));
    ASSERT_EQ(steps.size(), 501u);
    EXPECT_NEAR(steps.back().truth.p_WL.z(), -1.0 + 0.5 * 9.8 * (1.0 - share) * 2.0 * 2.0,
                1e-9);  // rounding of 2,000 steps
  }
}

TEST(AddedModelTest, MessagesNameIt) {
  EXPECT_EQ(
      find_error("{ law: unsteady }"),
      "added:4: controller.law: expected cooperative, pid, qsf, steady or a shared library (a "
      "path ending in .so), got unsteady; did you mean 'steady'?");
  EXPECT_EQ(find_error("{ law: steady, share: 0 }"),
            "added:4: controller.share: expected > 0, got 0");
  EXPECT_EQ(find_error("{ law: pid, share: 1 }"),
            "added:4: controller.share: a key of law 'steady', here law is 'pid'");
}

}  // namespace
}  // namespace sls
