/// How cables hang, against the catenary's closed forms; what shipped scenarios show.
#include "common/scene/load_scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace sls::scene {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

double calc_length(const Points& points) {
  double length = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

double find_lowest(const Points& points) {
  return std::max_element(points.begin(), points.end(),
                          [](const auto& a, const auto& b) { return a.z() < b.z(); })
      ->z();  // z is down
}

/// Of a symmetric catenary with the parameter a over the width h: L = 2 a sinh(h / 2a), and its sag
/// is a (cosh(h / 2a) − 1).
TEST(HangingPointsTest, ASymmetricCableHasTheSagAndTheShapeOfItsCatenary) {
  for (const double a : {0.15, 0.3, 1.0, 20.0}) {
    const double width = 1.2, half = width / (2 * a);
    const Points points =
        calc_hanging_points({1, 2, -3}, {1, 2 + width, -3}, 2 * a * std::sinh(half));
    ASSERT_EQ(points.size(), kHangingPoints);
    EXPECT_NEAR(find_lowest(points), -3 + a * (std::cosh(half) - 1), 1e-9) << a;
    for (const Vector3d& point : points) {
      const double x = point.y() - 2 - 0.5 * width;
      EXPECT_NEAR(point.z(), -3 + a * (std::cosh(half) - std::cosh(x / a)), 1e-9) << a;
    }
  }
}

TEST(HangingPointsTest, AnyCableReachesBothEndsAndHasItsLength) {
  std::mt19937 random(34);
  std::uniform_real_distribution<double> place(-2, 2), excess(1e-6, 3);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d from(place(random), place(random), place(random));
    Vector3d to(place(random), place(random), place(random));
    if (i % 10 == 0) to.head<2>() = from.head<2>();  // one end above the other
    const double length = (to - from).norm() * (1 + excess(random));
    const Points points = calc_hanging_points(from, to, length);
    EXPECT_EQ(points.front(), from);
    EXPECT_EQ(points.back(), to);
    EXPECT_LT(calc_length(points), length * (1 + 1e-6)) << i;
    EXPECT_GT(calc_length(points), length * 0.99) << i;  // 24 parts of a curve
  }
}

TEST(HangingPointsTest, ACableBetweenEndsAboveEachOtherHangsInAFoldBelowBoth) {
  const Points points = calc_hanging_points({0, 0, -1}, {0, 0, -0.6}, 1.0);
  // Down and up again: 0.4 m and twice 0.3 m. Drawn with a width of 1 mm.
  EXPECT_NEAR(find_lowest(points), -0.6 + 0.3, 1e-3);
}

TEST(HangingPointsTest, ACableNoLongerThanTheDistanceIsStraight) {
  for (const double length : {0.5, 1.0})
    EXPECT_EQ(calc_hanging_points({0, 0, 0}, {0.6, 0, 0.8}, length),
              (Points{{0, 0, 0}, {0.6, 0, 0.8}}));
}

Parameters make_parameters(const std::string& scenario) {
  Parameters parameters;
  parameters.scenario_text(
      sls::test::read_bytes(SLS_SOURCE_DIR "/config/scenarios/" + scenario + ".yaml"));
  return parameters;
}

TEST(LoadSceneTest, ARodHasNoneAndATextThatIsNoScenarioHasNone) {
  EXPECT_FALSE(read_load_scene(make_parameters("figure_eight")));
  EXPECT_FALSE(read_load_scene(make_parameters("fleet")));
  EXPECT_FALSE(read_load_scene(Parameters()));
}

TEST(LoadSceneTest, TheOutlineOfABoxGoesAroundIt) {
  const auto scene = read_load_scene(make_parameters("cable_cut"));
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->outline_L.size(), 4U);
  EXPECT_EQ(scene->attachments_L.at(2), Vector3d(-0.3048, -0.2286, -0.01125));
  double around = 0.0;
  for (std::size_t i = 0; i < 4; ++i)
    around += (scene->outline_L[i] - scene->outline_L[(i + 1) % 4]).norm();
  EXPECT_NEAR(around, 2 * (2 * 0.3048 + 2 * 0.2286), 1e-12);  // sides, no diagonal
  EXPECT_NEAR(scene->full_tension, 2 * 0.0625 * 9.8, 1e-12);
  EXPECT_FALSE(scene->ground_z_W);
}

TEST(LoadSceneTest, APointLoadHasNoOutlineAndAGroundIsKnown) {
  const auto scene = read_load_scene(make_parameters("pick_up_and_set_down"));
  ASSERT_TRUE(scene);
  EXPECT_TRUE(scene->outline_L.empty());
  EXPECT_EQ(scene->ground_z_W, 0.0);
}

TEST(LoadSceneTest, ACableIsReadFromTheSignalsWithTheNumberOfItsRelease) {
  Parameters parameters = make_parameters("cable_cut");
  for (int i = 0; i < 11; ++i)
    parameters.signals().emplace_back().name(i == 10 ? "cable_released" : "other");
  const auto scene = read_load_scene(parameters);
  ASSERT_TRUE(scene);
  const auto cable = read_cable(*scene, {2.5, 1.5, 1, 0.5, -0.5, 0.5, -0.5, 7, 8, 9, 1});
  ASSERT_TRUE(cable);
  EXPECT_EQ(cable->tension, 2.5);
  EXPECT_EQ(cable->length, 1.5);
  EXPECT_TRUE(cable->is_taut);
  EXPECT_TRUE(cable->is_released);
  EXPECT_EQ(cable->q_WL.coeffs(), Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5).coeffs());
  EXPECT_EQ(cable->w_WL_L, Vector3d(7, 8, 9));
  EXPECT_FALSE(read_cable(*scene, {2.5, 1.5, 1}));
}

TEST(LoadSceneTest, ColoursShowTheTensionAndASlackCableLiesOnTheGround) {
  LoadScene scene;
  scene.full_tension = 4.0;
  scene.ground_z_W = 0.5;
  Cable cable;
  cable.length = 3.0;
  EXPECT_EQ(calc_colour(scene, cable), kSlackColour);
  EXPECT_EQ(find_lowest(calc_cable_points(scene, cable, {0, 0, -1}, {1, 0, 0.4})), 0.5);
  cable.is_taut = true;
  EXPECT_EQ(calc_colour(scene, cable), kLowColour);
  cable.tension = 2.0;
  EXPECT_NEAR(calc_colour(scene, cable)[0], 0.5F * (kLowColour[0] + kHighColour[0]), 1e-6F);
  cable.tension = 9.0;
  EXPECT_NEAR(calc_colour(scene, cable)[1], kHighColour[1], 1e-6F);
  EXPECT_EQ(calc_cable_points(scene, cable, {0, 0, -1}, {1, 0, 0.4}).size(), 2U);
}

}  // namespace
}  // namespace sls::scene
