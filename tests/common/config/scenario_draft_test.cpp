#include "common/config/scenario_draft.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/common/config/support.hpp"
#include "tests/support/errors.hpp"

namespace sls::config {
namespace {

using testing::HasSubstr;

const std::filesystem::path kFolder = SLS_SOURCE_DIR "/config/scenarios";

std::string find_error(ScenarioDraft draft, const std::string& path, const std::string& value) {
  return sls::test::find_error<ConfigError>([&] {
    draft.set(path, value);
    draft.make_scenario();
  });
}

TEST(ScenarioDraftTest, KeepsEveryValueOfEveryShippedScenario) {
  for (const auto& file : test::list_yaml_files("config/scenarios"))
    EXPECT_EQ(to_yaml(ScenarioDraft(file).make_scenario()), to_yaml(load_scenario(file))) << file;
}

TEST(ScenarioDraftTest, WritesATextThatIsTheSameScenario) {
  for (const auto& file : test::list_yaml_files("config/scenarios")) {
    ScenarioDraft draft(file);
    draft.set("vehicle.gravity_m_s2", "9.75");
    const Scenario made = draft.make_scenario();
    const Scenario read = parse_scenario(draft.to_text(), "again");
    EXPECT_EQ(to_yaml(read), to_yaml(made)) << draft.to_text();
    EXPECT_EQ(read.sha256, made.sha256);
    EXPECT_EQ(read.text, made.text);
    EXPECT_EQ(made.folder, kFolder);
  }
}

TEST(ScenarioDraftTest, ReplacesValuesInMapsAndLists) {
  ScenarioDraft draft(kFolder / "figure_eight.yaml");
  draft.set("vehicle.load_mass_kg", "0.30000000000000004");
  draft.set("faults", "[{ delay: { by_s: 0.004, on: command } }]");
  draft.set("faults.0.delay.by_s", "0.008");
  draft.set("plant.initial.load_position_m", "[1, 2, -3]");
  draft.set("plant.initial.load_position_m.2", "-1.5");
  const Scenario scenario = draft.make_scenario();
  EXPECT_EQ(scenario.vehicle.load_mass, 0.30000000000000004);
  EXPECT_NE(scenario.text.find("\"on\": command"), std::string::npos);  // not true, as in YAML 1.1
  ASSERT_EQ(scenario.faults.size(), 1u);
  EXPECT_EQ(std::get<DelayFault>(scenario.faults[0].effect).by_ns, 8'000'000);
  EXPECT_EQ(scenario.plant.initial.position, Eigen::Vector3d(1, 2, -1.5));
}

TEST(ScenarioDraftTest, AddsKeysThatTheFileLeavesOut) {
  ScenarioDraft draft(kFolder / "figure_eight.yaml");
  draft.set("controller.model.load_mass_kg", "0.1");
  EXPECT_EQ(draft.make_scenario().controller.model.vehicle.load_mass, 0.1);
}

TEST(ScenarioDraftTest, KeepsTextsInQuotes) {
  ScenarioDraft draft(kFolder / "figure_eight.yaml");
  draft.set("name", "\"17\"");  // without quotes it would be a number
  EXPECT_THAT(draft.to_text(), HasSubstr("name: \"17\"\n"));
  EXPECT_EQ(draft.make_scenario().name, "17");
}

TEST(ScenarioDraftTest, RefusesPathsThatLeadNowhere) {
  const ScenarioDraft draft(kFolder / "figure_eight.yaml");
  EXPECT_THAT(find_error(draft, "vehicle.load_mas_kg", "1"), HasSubstr("vehicle.load_mas_kg"));
  EXPECT_THAT(find_error(draft, "vehicle.load_mass_kg.more", "1"),
              HasSubstr("vehicle.load_mass_kg: expected a map or a list, got 0."));
  EXPECT_THAT(find_error(draft, "mission.7.for_s", "1"),
              HasSubstr("mission: expected one of the list's items, 0 to"));
  EXPECT_THAT(find_error(draft, "vehicle..load_mass_kg", "1"),
              HasSubstr("expected keys separated by dots"));
  EXPECT_THAT(find_error(draft, "vehicle.load_mass_kg", "[1"), HasSubstr("expected YAML"));
  EXPECT_THAT(find_error(draft, "vehicle.load_mass_kg", "-0.16"), HasSubstr("figure_eight.yaml:"));
  EXPECT_THAT(find_error(draft, "vehicle.load_mass_kg", "-0.16"),
              HasSubstr("vehicle.load_mass_kg: expected > 0, got -0.16"));
}

}  // namespace
}  // namespace sls::config
