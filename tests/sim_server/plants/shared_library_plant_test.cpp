// Plants in shared libraries with errors: the exact message of each.
#include <gtest/gtest.h>

#include "sim_server/plants/plant.hpp"
#include "sim_server/plants/shared_library/sls_plant.h"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::sim {
namespace {

std::string library(const std::string& name) { return std::string(SLS_LIBRARIES) + "/" + name; }

const std::string kGood = library("plant.so");
const Eigen::Vector3d kForce(0.0, 0.0, -16.0);

/// Four vehicles with the plant `model`; `further` are lines of the section `plant`.
config::Scenario make_scenario(const std::string& model, const std::string& further = "") {
  return config::parse_scenario(
      "name: hover\n"
      "vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }\n"
      "vehicles: 4\n"
      "mission: [{ hold: { position_m: [0, 0, -0.5] }, for_s: 2 }]\n"
      "plant:\n"
      "  initial: { load_position_m: [0, 0, -0.5] }\n"
      "  model: " +
          model + "\n" + further,
      "flight.yaml");
}

config::Scenario make_misbehaving(const std::string& parameters) {
  return make_scenario(kGood, "  parameters: { " + parameters + " }\n");
}

/// The plants of vehicles 2 and 3.
std::vector<PlantOfVehicles> make_two(const config::Scenario& scenario) {
  return make_plants(find_plant_type(scenario.plant.model), scenario, {2, 3});
}

/// Flies 100 periods of four steps and returns the message of the exception. A refused library
/// throws config::ConfigError.
std::string fly(const config::Scenario& scenario) {
  try {
    const auto plants = make_two(scenario);
    for (int period = 0; period < 100; ++period) plants[1].plant->advance({kForce}, 4);
    return "no error";
  } catch (const config::ConfigError& error) {
    return std::string("refused: ") + error.what();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

std::string refused(const std::string& file, const std::string& message,
                    const std::string& place = "flight.yaml:7: plant.model") {
  return "refused: " + place + ": " + file + ": " + message;
}

TEST(SharedLibraryPlantTest, MovesAVehicleAndPublishesItsSignals) {
  const auto plants = make_two(make_scenario(kGood));
  Plant& plant = *plants[1].plant;
  const auto signals = plant.signals();
  ASSERT_EQ(signals.size(), 2u);
  EXPECT_EQ(signals[0].name + " " + signals[0].unit, "steps 1");
  EXPECT_EQ(signals[1].name + " " + signals[1].unit, "held_force_z_n N");
  plant.advance({kForce}, 3);
  plant.advance({kForce}, 1);
  const model::Measurement& measured = plant.measurement(0);
  EXPECT_EQ(measured.signals, Eigen::Vector2d(4.0, -16.0));
  // Vehicle 3 of a grid of 5 m is in its second row and column.
  EXPECT_EQ(measured.p_WL, Eigen::Vector3d(5.0, 5.0, -0.5));
  EXPECT_EQ(measured.p_WQ, Eigen::Vector3d(5.0, 5.0, -1.5));
  EXPECT_EQ(measured.rod.alpha, 0.0);
}

TEST(SharedLibraryPlantTest, PathsAreRelativeToTheScenarioFile) {
  const test::TemporaryFolder folder;
  std::filesystem::create_symlink(kGood, folder / "mine.so");
  config::Scenario scenario = make_scenario("mine.so");
  scenario.folder = folder.path();
  EXPECT_EQ(fly(scenario), "no error");
  scenario.folder = folder / "other";
  EXPECT_EQ(fly(scenario), refused(folder / "other/mine.so",
                                   "expected a shared library, got no file of this name"));
}

TEST(SharedLibraryPlantTest, TablesOfOtherHeadersAreRefused) {
  const auto refuse = [](const std::string& name, const std::string& message) {
    EXPECT_EQ(fly(make_scenario(library(name))), refused(library(name), message));
  };
  const auto wrong_size = [](const std::string& type, std::size_t size) {
    return "expected sizeof(" + type + ") " + std::to_string(size) + ", got " +
           std::to_string(size + 8) + "; compile it against the header of this version";
  };
  refuse("plant_version.so", "expected version 1 of the interface, got 2");
  refuse("plant_table.so", wrong_size("sls_plant_functions", sizeof(sls_plant_functions)));
  refuse("plant_setup.so", wrong_size("sls_plant_setup", sizeof(sls_plant_setup)));
  refuse("plant_state.so", wrong_size("sls_plant_state", sizeof(sls_plant_state)));
  refuse("plant_no_table.so", "sls_plant() returned no table of functions");
  refuse("plant_no_measure.so",
         "expected create, destroy, advance and measure, got a null pointer for one");
  refuse("empty.so", "expected a library that defines sls_plant(), got none (" +
                         library("empty.so") + ": undefined symbol: sls_plant)");
}

TEST(SharedLibraryPlantTest, SignalsThatStateCsvCannotHoldAreRefused) {
  const auto refuse = [](const std::string& name, const std::string& message) {
    EXPECT_EQ(fly(make_scenario(library(name))), refused(library(name), message));
  };
  refuse("plant_65_signals.so", "expected at most 64 signals, got 65");
  refuse("plant_3_signals.so", "expected a name and a unit for signal 2, got none");
  const std::string expectation =
      "expected lower-case letters, digits and '_' as the name of signal 0, got '";
  refuse("plant_comma.so", expectation + "a,b'");
  refuse("plant_nameless.so", expectation + "'");
}

TEST(SharedLibraryPlantTest, ErrorsAtCreationNameTheParameters) {
  const std::string place = "flight.yaml:8: plant.parameters";
  EXPECT_EQ(fly(make_misbehaving("in: create")),
            refused(kGood, "failed without saying why", place));
  EXPECT_EQ(
      fly(make_misbehaving("do: say the parameters, in: create, drag: [0.5, x]")),
      refused(kGood, R"({"do": "say the parameters", "in": "create", "drag": [0.5, "x"]})", place));
  EXPECT_EQ(fly(make_misbehaving("do: throw, in: create")),
            refused(kGood + ": create, vehicle 2, step 0", "threw an exception: out of luck"));
  EXPECT_EQ(fly(make_misbehaving("do: round up, in: create")),
            refused(kGood + ": create, vehicle 2, step 0",
                    "changed the floating-point mode of the thread (rounding, flush to zero or "
                    "traps)"));
}

TEST(SharedLibraryPlantTest, AWrongFirstMeasurementIsReportedBeforeTheFlight) {
  EXPECT_EQ(
      fly(make_misbehaving("do: position that is no number, in: measure")),
      kGood + ": measure, vehicle 2, step 0: quad_x_m is not finite after step 0 of the plant");
}

TEST(SharedLibraryPlantTest, AnErrorInFlightNamesFunctionVehicleAndStep) {
  const auto fly_wrong = [](const std::string& function, const std::string& what) {
    return fly(make_misbehaving("at: 8, in: " + function + ", do: " + what));
  };
  const std::string advance = kGood + ": advance, vehicle 3, step 8: ";
  const std::string measure = kGood + ": measure, vehicle 3, step 8: ";
  const std::string mode =
      "changed the floating-point mode of the thread (rounding, flush to zero or traps)";
  EXPECT_EQ(fly_wrong("advance", "fail"), advance + "the rope is torn");
  EXPECT_EQ(fly_wrong("advance", "fail without a word"), advance + "failed without saying why");
  EXPECT_EQ(fly_wrong("advance", "throw"), advance + "threw an exception: out of luck");
  EXPECT_EQ(fly_wrong("advance", "flush to zero"), advance + mode);
  EXPECT_EQ(fly_wrong("measure", "throw a number"), measure + "threw an exception");
  EXPECT_EQ(fly_wrong("measure", "round up"), measure + mode);
  EXPECT_EQ(fly_wrong("measure", "position that is no number"),
            measure + "quad_x_m is not finite after step 8 of the plant");
  EXPECT_EQ(fly_wrong("measure", "rate that is no number"),
            measure + "body_rates_rad_s is not finite");
  EXPECT_EQ(fly_wrong("measure", "signal that is no number"),
            measure + "signal held_force_z_n is not finite");
  EXPECT_EQ(fly_wrong("measure", "attitude of length 2"),
            measure + "expected a unit quaternion as attitude_wb, got one of length 2.000000");
}

TEST(SharedLibraryPlantTest, AForceThatIsNotFiniteIsNotHandedToIt) {
  const auto plants = make_two(make_scenario(kGood));
  EXPECT_EQ(test::find_error<std::runtime_error>(
                [&] { plants[0].plant->advance({Eigen::Vector3d(0.0, std::nan(""), 0.0)}, 4); }),
            "force_y_n is not finite after step 0 of the plant");
}

}  // namespace
}  // namespace sls::sim
