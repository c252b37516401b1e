// Autopilots in shared libraries with errors: the exact message of each.
#include <gtest/gtest.h>
#include <signal.h>

#include <cfenv>

#include "common/plugin/shared_library.hpp"
#include "sim_server/autopilots/shared_library/sls_autopilot.h"
#include "tests/sim_server/autopilots/support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::sim {
namespace {

std::string library(const std::string& name) { return std::string(SLS_LIBRARIES) + "/" + name; }

const std::string kGood = library("autopilot.so");
const Eigen::Vector3d kForce(3.0, 4.0, -12.0);
const std::string kModeChanged =
    "changed the floating-point mode of the thread (rounding, flush to zero or traps)";

AutopilotSetup make_misbehaving(const std::string& where, const std::string& what, int at = 8) {
  const std::string json =
      R"({"in": ")" + where + R"(", "do": ")" + what + R"(", "at": )" + std::to_string(at) + "}";
  return make_setup(kGood, config::LibraryParameters{json, "flight.yaml:11"});
}

/// Steps the autopilot 20 times and returns the message of the exception. A refused library throws
/// config::ConfigError.
std::string fly(const AutopilotSetup& setup) {
  try {
    const auto autopilot = make_autopilot(setup);
    for (int k = 0; k < 20; ++k) autopilot->step(make_input(kForce));
    return "no error";
  } catch (const config::ConfigError& error) {
    return std::string("refused: ") + error.what();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

std::string refused(const std::string& file, const std::string& message,
                    const std::string& place = "flight.yaml:9: autopilot.model") {
  return "refused: " + place + ": " + file + ": " + message;
}

TEST(SharedLibraryAutopilotTest, TurnsAForceIntoRotorSpeeds) {
  const AutopilotSetup setup = make_setup(kGood);
  const auto autopilot = make_autopilot(setup);
  AutopilotOutput output;
  for (int k = 1; k <= 30; ++k) {
    output = autopilot->step(make_input(kForce));
    const double thrust = 13.0 * (1.0 - std::pow(0.75, k));  // 3-4-12-13, through its filter
    ASSERT_NEAR(output.thrust, thrust, 1e-12) << k;
    for (int i = 0; i < 4; ++i)
      ASSERT_NEAR(setup.airframe.rotors[i].thrust_constant * std::pow(output.rotor_speeds[i], 2),
                  thrust / 4, 1e-12);
  }
  EXPECT_EQ(output.rotor_speeds.size(), 4);
  EXPECT_EQ(output.q_WB.coeffs(), Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5).coeffs());
  EXPECT_FALSE(output.direction_W);
}

TEST(SharedLibraryAutopilotTest, IsGivenTheWholeSetup) {
  const std::string parameters = R"({"in": "create", "do": "say the setup", "at": 8})";
  EXPECT_EQ(fly(make_misbehaving("create", "say the setup")),
            refused(kGood,
                    parameters +
                        " id 3 T 0.004 m 1.5 mL 0.2 L 1.1 g 9.8 body 1.55 at 0.01 -0.02 0.03 "
                        "J 0.03 0.001 0.002 0.001 0.029 0.003 0.002 0.003 0.061 "
                        "4 rotors, last at -0.13 0.2 -0.02 along 0 0.6 -0.8 spin -1 thrust 8e-06 "
                        "torque 0.08 speed 30 to 1103",
                    "flight.yaml:11: autopilot.parameters"));
}

TEST(SharedLibraryAutopilotTest, IsGivenTheWholeInput) {
  EXPECT_EQ(fly(make_misbehaving("step", "say the input")),
            kGood +
                ": step, vehicle 3, step 8: step 8 t 0.032 F 3 4 -12 v 0.1 0.2 0.3 "
                "q 0.5 -0.5 0.5 0.5 w 0.4 0.5 0.6");
}

TEST(SharedLibraryAutopilotTest, MayTurnTheThrustInsteadOfTheVehicle) {
  const auto autopilot = make_autopilot(make_misbehaving("step", "direction", 1));
  EXPECT_FALSE(autopilot->step(make_input(kForce)).direction_W);
  EXPECT_EQ(autopilot->step(make_input(kForce)).direction_W, Eigen::Vector3d(0.6, 0.0, -0.8));
}

TEST(SharedLibraryAutopilotTest, TwiceTheSameInputsGiveTheSameBits) {
  const AutopilotSetup setup = make_setup(kGood);
  const auto one = make_autopilot(setup), two = make_autopilot(setup);
  const auto make_force = [](int k) {
    return Eigen::Vector3d(std::sin(0.1 * k), std::cos(0.3 * k), -16.0 + 0.01 * k);
  };
  std::vector<Eigen::VectorXd> speeds;
  for (int k = 0; k < 50; ++k) speeds.push_back(one->step(make_input(make_force(k))).rotor_speeds);
  for (int k = 0; k < 50; ++k) {
    one->step(make_input(kForce));  // calls of another instance between the steps change nothing
    ASSERT_EQ(two->step(make_input(make_force(k))).rotor_speeds, speeds[k]) << k;
  }
}

TEST(SharedLibraryAutopilotTest, PathsAreRelativeToTheScenarioFile) {
  const test::TemporaryFolder folder;
  std::filesystem::create_symlink(kGood, folder / "mine.so");
  AutopilotSetup setup = make_setup("mine.so");
  setup.folder = folder.path();
  EXPECT_EQ(fly(setup), "no error");
  setup.folder = folder / "other";
  EXPECT_EQ(fly(setup), refused(folder / "other/mine.so",
                                "expected a shared library, got no file of this name"));
}

TEST(SharedLibraryAutopilotTest, TablesOfOtherHeadersAreRefused) {
  const auto refuse = [](const std::string& name, const std::string& message) {
    EXPECT_EQ(fly(make_setup(library(name))), refused(library(name), message));
  };
  const auto wrong_size = [](const std::string& type, std::size_t size) {
    return "expected sizeof(" + type + ") " + std::to_string(size) + ", got " +
           std::to_string(size + 8) + "; compile it against the header of this version";
  };
  refuse("autopilot_version.so", "expected version 1 of the interface, got 2");
  refuse("autopilot_table.so",
         wrong_size("sls_autopilot_functions", sizeof(sls_autopilot_functions)));
  refuse("autopilot_setup.so", wrong_size("sls_autopilot_setup", sizeof(sls_autopilot_setup)));
  refuse("autopilot_rotor.so", wrong_size("sls_autopilot_rotor", sizeof(sls_autopilot_rotor)));
  refuse("autopilot_input.so", wrong_size("sls_autopilot_input", sizeof(sls_autopilot_input)));
  refuse("autopilot_output.so", wrong_size("sls_autopilot_output", sizeof(sls_autopilot_output)));
  refuse("autopilot_no_table.so", "sls_autopilot() returned no table of functions");
  for (const char* name :
       {"autopilot_no_create.so", "autopilot_no_destroy.so", "autopilot_no_step.so"})
    refuse(name, "expected create, destroy and step, got a null pointer for one of them");
  refuse("empty.so", "expected a library that defines sls_autopilot(), got none (" +
                         library("empty.so") + ": undefined symbol: sls_autopilot)");
  refuse("fast_math.so", kModeChanged + " when it was loaded; link it without -ffast-math");
}

TEST(SharedLibraryAutopilotTest, ErrorsAtCreationNameTheParameters) {
  const std::string call = kGood + ": create, vehicle 3, step 0";
  EXPECT_EQ(fly(make_misbehaving("create", "")),
            refused(kGood, "failed without saying why", "flight.yaml:11: autopilot.parameters"));
  EXPECT_EQ(fly(make_misbehaving("create", "throw")),
            refused(call, "threw an exception: out of luck"));
  EXPECT_EQ(fly(make_misbehaving("create", "round up")), refused(call, kModeChanged));
}

TEST(SharedLibraryAutopilotTest, AnErrorInFlightNamesFunctionVehicleAndStep) {
  const auto expect = [](const std::string& what, const std::string& message) {
    EXPECT_EQ(fly(make_misbehaving("step", what)), kGood + ": step, vehicle 3, step 8: " + message);
  };
  expect("fail", "the gyroscope is dead");
  expect("fail without a word", "failed without saying why");
  expect("throw", "threw an exception: out of luck");
  expect("throw a number", "threw an exception");
  expect("round up", kModeChanged);
  expect("flush to zero", kModeChanged);
  EXPECT_EQ(std::fegetround(), FE_TONEAREST);
  expect("three rotors", "rotor_speeds_rad_s[3] is not finite");
  expect("five rotors", "wrote the speed of rotor 4, expected at most the 4 that there are");
  expect("speed that is no number", "rotor_speeds_rad_s[1] is not finite");
  expect("speed without end", "rotor_speeds_rad_s[2] is not finite");
  expect("negative speed", "rotor_speeds_rad_s[2]: expected >= 0, got -0.500000");
  expect("attitude that is no number", "attitude_wb[2] is not finite");
  expect("attitude of length 2",
         "expected a unit quaternion as attitude_wb, got one of length 2.000000");
  expect("thrust that is no number", "thrust_n is not finite");
  expect("direction that is no number", "direction[1] is not finite");
  expect("direction of length 2",
         "expected a unit vector as direction, got one of length 2.000000");
}

TEST(SharedLibraryAutopilotTest, AnErrorInDestroyIsAWarning) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(fly(make_misbehaving("destroy", "throw")), "no error");
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "shared_library_autopilot_test: warning: " + kGood +
                ": destroy, vehicle 3, step 20: threw an exception: out of luck\n");
}

class AutopilotCrashTest : public testing::TestWithParam<std::pair<const char*, int>> {};

TEST_P(AutopilotCrashTest, IsNamedWithLibraryFunctionVehicleAndStep) {
  // The death test runs in a new process: in this one the watchdog's thread may already run.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto [how, signal] = GetParam();
  const std::string crashed = ": crashed \\(signal " + std::to_string(signal) + "\\)";
  for (const auto& [where, step] : {std::pair("create", "0"), std::pair("step", "8")})
    EXPECT_EXIT(fly(make_misbehaving(where, how)), testing::KilledBySignal(signal),
                std::string("autopilot.so: ") + where + ", vehicle 3, step " + step + crashed);
}

INSTANTIATE_TEST_SUITE_P(Signals, AutopilotCrashTest,
                         testing::Values(std::pair("crash", SIGSEGV), std::pair("abort", SIGABRT),
                                         std::pair("overflow the stack", SIGSEGV)));

TEST(SharedLibraryAutopilotTest, ACallThatDoesNotReturnEndsTheProgramWithItsPlace) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto hang = [] {
    plugin::set_patience(0.1);
    fly(make_misbehaving("step", "hang"));
  };
  EXPECT_EXIT(hang(), testing::ExitedWithCode(1),
              "autopilot.so: step, vehicle 3, step 8: has not returned for .* s: ends the program");
}

}  // namespace
}  // namespace sls::sim
