// Shared-library controllers that do something wrong: the exact error message of each.
#include <gtest/gtest.h>

#include "control_client/flight_controller.hpp"
#include "control_client/laws/shared_library/sls_controller.h"
#include "tests/support/temporary_folder.hpp"

namespace sls::control {
namespace {

constexpr std::uint32_t kVehicle = 3;

std::string library(const std::string& name) { return std::string(SLS_LIBRARIES) + "/" + name; }

const std::string kGood = library("controller.so");

/// A hover of two seconds with the law `law`; `further` are lines of the section `controller`.
config::Scenario make_scenario(const std::string& law, const std::string& further = "") {
  return config::parse_scenario(
      "name: hover\n"
      "vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }\n"
      "plant: { initial: { load_position_m: [0, 0, -0.5] } }\n"
      "mission: [{ hold: { position_m: [0, 0, -0.5] }, for_s: 2 }]\n"
      "controller:\n"
      "  law: " +
          law + "\n" + further,
      "flight.yaml");
}

config::Scenario make_misbehaving(const std::string& parameters) {
  return make_scenario(kGood, "  parameters: { " + parameters + " }\n");
}

/// Hovers until the mission is over. @returns the message of the exception, or the fault. The
/// message of a refused library comes from config::ConfigError.
std::string fly(const config::Scenario& scenario, bool checks_purity = false) {
  const auto hovering = model::make_state({0.0, 0.0, -1.5}, Eigen::Vector3d::Zero(), {}, 1.0);
  try {
    const FlightController controller(scenario, kVehicle, checks_purity);
    model::Answer answer;
    for (std::uint64_t step = 0; answer.mission == MissionPhase::kRunning; ++step)
      answer = controller.calc_answer(step, hovering, answer.memory);
    return to_string(answer.error_code);
  } catch (const config::ConfigError& error) {
    return std::string("refused: ") + error.what();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

std::string refused(const std::string& file, const std::string& message,
                    const std::string& place = "flight.yaml:6: controller.law") {
  return "refused: " + place + ": " + file + ": " + message;
}

/// The message of an error at step 5.
std::string in_answer(const std::string& message) {
  return kGood + ": answer, vehicle 3, step 5: " + message;
}

TEST(SharedLibraryLawTest, FliesLikeALawOfTheProjectAndRemembersItsNumbers) {
  const FlightController controller(make_misbehaving("memory: 2"), kVehicle);
  EXPECT_EQ(controller.memory_size(), 2);
  model::Answer answer;
  for (std::uint64_t step = 0; step < 3; ++step)
    answer = controller.calc_answer(
        step, model::make_state({0, 0, -1.5}, Eigen::Vector3d::Zero(), {}, 1.0), answer.memory);
  EXPECT_EQ(answer.f_Q_W, Eigen::Vector3d(0.0, 0.0, -1.7 * 9.8));
  EXPECT_EQ(answer.memory.numbers, Eigen::Vector2d(3.0, 3.0));
  EXPECT_EQ(fly(make_scenario(kGood)), "none");
}

TEST(SharedLibraryLawTest, PathsAreRelativeToTheScenarioFile) {
  const test::TemporaryFolder folder;
  std::filesystem::create_symlink(kGood, folder / "mine.so");
  config::Scenario scenario = make_scenario("./mine.so");
  scenario.folder = folder.path();
  EXPECT_EQ(fly(scenario), "none");
  scenario.folder = folder / "other";
  EXPECT_EQ(fly(scenario), refused(folder / "other/mine.so",
                                   "expected a shared library, got no file of this name"));
}

TEST(SharedLibraryLawTest, TablesOfOtherHeadersAreRefused) {
  const auto refuse = [](const std::string& name, const std::string& message) {
    EXPECT_EQ(fly(make_scenario(library(name))), refused(library(name), message));
  };
  const auto wrong_size = [](const std::string& type, std::size_t size) {
    return "expected sizeof(" + type + ") " + std::to_string(size) + ", got " +
           std::to_string(size + 8) + "; compile it against the header of this version";
  };
  refuse("controller_version.so", "expected version 1 of the interface, got 2");
  refuse("controller_table.so",
         wrong_size("sls_controller_functions", sizeof(sls_controller_functions)));
  refuse("controller_setup.so", wrong_size("sls_controller_setup", sizeof(sls_controller_setup)));
  refuse("controller_input.so", wrong_size("sls_controller_input", sizeof(sls_controller_input)));
  refuse("controller_output.so",
         wrong_size("sls_controller_output", sizeof(sls_controller_output)));
  refuse("controller_no_table.so", "sls_controller() returned no table of functions");
  refuse("controller_no_answer.so",
         "expected create, destroy and answer, got a null pointer for one of them");
  refuse("empty.so", "expected a library that defines sls_controller(), got none (" +
                         library("empty.so") + ": undefined symbol: sls_controller)");
}

TEST(SharedLibraryLawTest, ErrorsAtCreationNameTheParameters) {
  const std::string place = "flight.yaml:7: controller.parameters";
  EXPECT_EQ(fly(make_misbehaving("do: refuse, in: create")),
            refused(kGood, "gain: expected > 0, got -1", place));
  EXPECT_EQ(fly(make_misbehaving("in: create")),
            refused(kGood, "failed without saying why", place));
  EXPECT_EQ(fly(make_misbehaving("do: say too much, in: create")),
            refused(kGood, std::string(512, 'x'), place));
  EXPECT_EQ(fly(make_misbehaving("do: throw, in: create")),
            refused(kGood + ": create, vehicle 3, step 0", "threw an exception: out of luck"));
  EXPECT_EQ(fly(make_misbehaving("do: round up, in: create")),
            refused(kGood + ": create, vehicle 3, step 0",
                    "changed the floating-point mode of the thread (rounding, flush to zero or "
                    "traps)"));
}

TEST(SharedLibraryLawTest, AParameterAloneIsAnErrorWithoutThem) {
  const std::string silent = library("controller_refusing.so");
  EXPECT_EQ(fly(make_scenario(silent)),
            refused(silent, "failed without saying why", "flight.yaml:6: controller"));
}

TEST(SharedLibraryLawTest, TooManyMemoryNumbersAreRefused) {
  EXPECT_EQ(fly(make_misbehaving("memory: 64")), "none");
  EXPECT_EQ(fly(make_misbehaving("memory: 65")),
            refused(kGood, "create: expected at most 64 memory numbers, got 65"));
}

TEST(SharedLibraryLawTest, WrongAnswersNameFunctionVehicleAndStep) {
  const auto fly_wrong = [](const std::string& what) {
    return fly(make_misbehaving("memory: 2, in: answer, at: 5, do: " + what));
  };
  EXPECT_EQ(fly_wrong("force that is no number"), in_answer("force_n[1] is not finite"));
  EXPECT_EQ(fly_wrong("infinite memory"), in_answer("memory[0] is not finite"));
  EXPECT_EQ(fly_wrong("write beyond the memory"),
            in_answer("wrote memory number 2, expected at most the 2 that create asked for"));
  EXPECT_EQ(fly_wrong("throw"), in_answer("threw an exception: out of luck"));
  EXPECT_EQ(fly_wrong("throw a number"), in_answer("threw an exception"));
  EXPECT_EQ(fly_wrong("fail"), in_answer("no solution after 20 iterations"));
  EXPECT_EQ(fly_wrong("fail without a word"), in_answer("failed without saying why"));
  EXPECT_EQ(fly_wrong("return 17"), in_answer("expected a return value from 0 to 4, got 17"));
  EXPECT_EQ(fly_wrong("round up"),
            in_answer("changed the floating-point mode of the thread (rounding, flush to zero or "
                      "traps)"));
}

TEST(SharedLibraryLawTest, ItsFaultsAreThoseOfEveryLaw) {
  const auto fly_fault = [](const std::string& what) {
    return fly(make_misbehaving("in: answer, at: 5, do: " + what));
  };
  EXPECT_EQ(fly_fault("free fall"), "free_fall");
  EXPECT_EQ(fly_fault("level rod"), "rod_level");
  EXPECT_EQ(fly_fault("not finite"), "not_finite");
}

TEST(SharedLibraryLawTest, MemoryOfItsOwnIsRefusedInTheFirst100Steps) {
  const auto impure = [](int step) {
    return kGood + ": vehicle 3, step " + std::to_string(step) +
           ": expected equal answers to equal inputs, got two different ones; what the law must "
           "remember belongs into its memory numbers";
  };
  const auto remembering = [](int step) {
    return make_misbehaving("do: remember, in: answer, at: " + std::to_string(step));
  };
  EXPECT_EQ(fly(remembering(0)), impure(0));
  EXPECT_EQ(fly(remembering(99)), impure(99));
  EXPECT_EQ(fly(remembering(100)), "none");
  EXPECT_EQ(fly(remembering(100), true), impure(100));
  EXPECT_EQ(fly(remembering(499), true), impure(499));
  // Here the two answers also differ in how many memory numbers they have.
  EXPECT_EQ(fly(make_misbehaving("do: fault every other time, in: answer, at: 7, memory: 3")),
            impure(7));
}

TEST(SharedLibraryLawTest, ParametersArriveAsJson) {
  const std::string begin = "refused: flight.yaml:7: controller.parameters: " + kGood + ": ";
  const auto say = [&](const std::string& yaml) {
    return fly(
        make_scenario(kGood, "  parameters: { do: say the parameters, in: create" + yaml + " }\n"));
  };
  const auto said = [&](const std::string& json) {
    return begin + "{\"do\": \"say the parameters\", \"in\": \"create\"" + json + "}";
  };
  EXPECT_EQ(say(""), said(""));
  EXPECT_EQ(say(", gain: 2.5, small: -1e-9, count: 3, name: north, is_on: true, is_off: false"),
            said(", \"gain\": 2.5, \"small\": -1.0e-09, \"count\": 3, \"name\": \"north\", "
                 "\"is_on\": true, \"is_off\": false"));
  EXPECT_EQ(say(", list: [1, [2, three], {}], map: { a: { b: [] } }, nothing: ~"),
            said(", \"list\": [1, [2, \"three\"], {}], \"map\": {\"a\": {\"b\": []}}, "
                 "\"nothing\": null"));
  EXPECT_EQ(say(", number: \"2.5\", flag: 'true', unit: 5 m, quote: 'a \"b\" \\', tab: \"\\t\""),
            said(", \"number\": \"2.5\", \"flag\": \"true\", \"unit\": \"5 m\", "
                 "\"quote\": \"a \\\"b\\\" \\\\\", \"tab\": \"\\t\""));
}

}  // namespace
}  // namespace sls::control
