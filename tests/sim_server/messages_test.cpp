#include "sim_server/messages.hpp"

#include <gtest/gtest.h>

#include "common/plugin/shared_library.hpp"
#include "common/text/sha256.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::sim {
namespace {

/// A plant that turns and publishes signals.
class TurningPlant : public Plant {
 public:
  void advance(const std::vector<Eigen::Vector3d>&, std::int64_t) override {}
  const model::Measurement& measurement(std::size_t) const override { return measurement_; }
  bool has_attitude() const override { return true; }
  std::vector<Signal> signals() const override { return {{"rotor_1_rad_s", "rad/s"}}; }

 private:
  model::Measurement measurement_;
};

TEST(MessagesTest, TheLibraryIsTheLoadedOneWhenAnotherHasTakenTheFilesPlace) {
  const sls::test::TemporaryFolder folder;
  config::Scenario scenario = config::load_scenario(SLS_SOURCE_DIR "/config/scenarios/short.yaml");
  scenario.folder = folder.path();
  scenario.plant.model.name = "mine.so";
  std::filesystem::copy(SLS_LIBRARIES "/empty.so", folder / "mine.so");
  const std::string flown = text::calc_file_sha256(folder / "mine.so");
  const plugin::SharedLibrary library(folder / "mine.so", "plant.model");
  for (int reset = 0; reset < 2; ++reset) {
    EXPECT_EQ(make_parameters_message(31, {0}, scenario, TurningPlant(), "sls 9.9")
                  .library_sha256()
                  .to_string(),
              flown);
    sls::test::write_bytes(folder / "repaired.so", "another");
    std::filesystem::rename(folder / "repaired.so", folder / "mine.so");
  }
}

TEST(MessagesTest, ParametersAreThoseInForce) {
  config::Scenario scenario =
      config::load_scenario(SLS_SOURCE_DIR "/config/scenarios/gazebo_legacy.yaml");
  config::override_period(scenario, 0.001);
  const Parameters message = make_parameters_message(31, {0}, scenario, TurningPlant(), "sls 9.9");
  EXPECT_EQ(message.run_id(), 31u);
  EXPECT_STREQ(message.contract_sha256().c_str(), bus::kContractSha256);
  EXPECT_EQ(message.scenario_text().to_string(), scenario.text);
  EXPECT_EQ(message.scenario_sha256().to_string(), scenario.sha256);
  EXPECT_EQ(message.library_sha256().size(), 0u);
  ASSERT_EQ(message.vehicles().size(), 1u);
  EXPECT_EQ(message.vehicles()[0].vehicle_id(), 0u);
  EXPECT_EQ(message.vehicles()[0].quad_mass_kg(), 1.5);
  EXPECT_EQ(message.vehicles()[0].load_mass_kg(), 0.201);
  EXPECT_EQ(message.vehicles()[0].rod_length_m(), 1.1);
  EXPECT_EQ(message.vehicles()[0].gravity_m_s2(), 9.8066);
  EXPECT_TRUE(message.has_attitude());
  ASSERT_EQ(message.signals().size(), 1u);
  EXPECT_STREQ(message.signals()[0].name().c_str(), "rotor_1_rad_s");
  EXPECT_STREQ(message.signals()[0].unit().c_str(), "rad/s");
  EXPECT_EQ(message.force_limit_n(), scenario.controller.force_limit_n);
  EXPECT_EQ(message.expected_recorders(), 1u);
  EXPECT_EQ(message.period_ns(), 1'000'000);
  EXPECT_EQ(message.step_ns(), 1'000'000);
  EXPECT_EQ(message.mode(), SyncMode::MODE_LOCKSTEP);
  EXPECT_EQ(message.real_time_factor(), 0.0);
  EXPECT_STREQ(message.version().c_str(), "sls 9.9");
}

}  // namespace
}  // namespace sls::sim
