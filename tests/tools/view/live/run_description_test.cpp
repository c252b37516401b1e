#include "tools/view/run_description.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/config/config_error.hpp"
#include "tests/tools/view/live/fake_server.hpp"

namespace sls::view {
namespace {

using nlohmann::json;
using test::make_parameters;

json describe(const Parameters& parameters) { return json::parse(describe_run(parameters)); }

TEST(RunDescriptionTest, DescribesTheMission) {
  auto parameters = make_parameters(0xab);
  parameters.signals().emplace_back().name("wind_m_s");
  parameters.signals().front().unit("m/s");
  const json run = describe(parameters);
  EXPECT_EQ(run.at("run_id"), "00000000000000ab");
  EXPECT_EQ(run.at("scenario"), "figure_eight");
  EXPECT_EQ(run.at("mode"), "lockstep");
  EXPECT_EQ(run.at("period_s"), 0.004);
  EXPECT_EQ(run.at("stages"), json::array({"figure_eight"}));
  const json& vehicle = run.at("vehicles").at(0);
  EXPECT_EQ(vehicle.at("load_mass_kg"), 0.2);
  EXPECT_EQ(vehicle.at("rotors").size(), 4u);
  EXPECT_EQ(vehicle.at("is_drawn_only"), true);
  const json& columns = run.at("columns");
  ASSERT_EQ(columns.size(), kColumns.size() + 1);
  EXPECT_EQ(columns.back(), json({{"name", "wind_m_s"}, {"unit", "m/s"}}));
  for (const auto& [name, unit] : {std::pair("quad_x_m", "m"), std::pair("load_vz_m_s", "m/s"),
                                   std::pair("alpha_rad", "rad"), std::pair("force_z_n", "N"),
                                   std::pair("beta_dot_rad_s", "rad/s"), std::pair("att_w", "1")}) {
    const json expected = {{"name", name}, {"unit", unit}};
    EXPECT_NE(std::find(columns.begin(), columns.end(), expected), columns.end()) << expected;
  }
}

/// x = a_x sin s and y = a_y sin 2s give |y| a_x² = 2 a_y |x| √(a_x² − x²).
TEST(RunDescriptionTest, ThePathLiesOnTheFigureEight) {
  const json path = describe(make_parameters(1)).at("path_m");
  ASSERT_GT(path.size(), 100u);
  for (const json& point : path) {
    const double x = point.at(0), y = point.at(1);
    EXPECT_NEAR(std::abs(y) * 1.5 * 1.5,
                2 * 0.75 * std::abs(x) * std::sqrt(std::max(0.0, 1.5 * 1.5 - x * x)), 1e-9);
  }
  EXPECT_NEAR(path.front().at(0).get<double>(), path.back().at(0).get<double>(), 1e-9);
}

TEST(RunDescriptionTest, RotorsAreThoseOfThePlant) {
  auto parameters = make_parameters(1, {0}, "multirotor_figure_eight");
  parameters.has_attitude(true);
  const json vehicle = describe(parameters).at("vehicles").at(0);
  EXPECT_FALSE(vehicle.contains("is_drawn_only"));
  ASSERT_EQ(vehicle.at("rotors").size(), 4u);
  EXPECT_EQ(vehicle.at("rotors").at(2), json({{"position_m", {0.13, -0.22, 0.0}}, {"spin", -1}}));
}

TEST(RunDescriptionTest, OneLoadOnCablesIsDescribedAndItsPathIsThatOfItsCentre) {
  EXPECT_EQ(describe(make_parameters(1)).at("load"), nullptr);
  const json run = describe(make_parameters(1, {0, 1, 2}, "three_carry_a_triangle_pose"));
  const json& load = run.at("load");
  EXPECT_EQ(load.at("attachments_m").at("1"), json({0.3083, 0, -0.01125}));
  EXPECT_EQ(load.at("outline_m").size(), 3u);
  EXPECT_EQ(load.at("ground_z_m"), nullptr);
  EXPECT_EQ(run.at("path_m").at(0), json({0, 0, -1}));
}

TEST(RunDescriptionTest, EveryShippedScenarioHasOneOfBoundedSize) {
  for (const auto& file : std::filesystem::directory_iterator(SLS_SOURCE_DIR "/config/scenarios")) {
    if (file.path().extension() != ".yaml") continue;
    const json run = describe(make_parameters(1, {0}, file.path().stem()));
    EXPECT_LE(run.at("path_m").size(), 2000u) << file.path();
    EXPECT_GE(run.at("path_m").size(), 1u) << file.path();
    EXPECT_FALSE(run.at("stages").empty()) << file.path();
  }
}

TEST(RunDescriptionTest, RefusesATextThatIsNoScenario) {
  auto parameters = make_parameters(0xab);
  parameters.scenario_text("name: x");
  EXPECT_THROW(describe_run(parameters), config::ConfigError);
}

}  // namespace
}  // namespace sls::view
