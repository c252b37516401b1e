// Compares measures with textbook formulas on the stored columns of the same flight, outcomes with
// those of the delay margin, and certificates with those of recordings.
#include "closed_loop/measured_flight.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "closed_loop/campaign_runs.hpp"
#include "closed_loop/delay_margin.hpp"
#include "closed_loop/flight_recorder.hpp"
#include "common/config/scenario_draft.hpp"
#include "common/text/sha256.hpp"
#include "recorder/manifest.hpp"
#include "tests/closed_loop/support.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::closed_loop::test {
namespace {

using sls::test::TemporaryFolder;

const std::vector<std::string> kAll = {"load_error_rms", "load_error_max", "settling",
                                       "overshoot",      "tilt_max",       "force_max",
                                       "time_of_loss",   "outcome"};

std::filesystem::path file_of(const std::string& name) {
  return std::string(SLS_SOURCE_DIR) + "/config/scenarios/" + name + ".yaml";
}

using Values = std::map<std::string, std::string>;

/// A shipped scenario with some values replaced.
config::Scenario load_changed(const std::string& name, const Values& values) {
  config::ScenarioDraft draft(file_of(name));
  for (const auto& [path, value] : values) draft.set(path, value);
  return draft.make_scenario();
}

/// The values of `flown` by column.
std::map<std::string, double> name_values(const config::Scenario& base,
                                          const MeasuredFlight& flown) {
  const MeasureList list(base, kAll);
  std::map<std::string, double> values;
  EXPECT_EQ(flown.values.size(), list.columns().size());
  for (std::size_t i = 0; i < flown.values.size(); ++i) values[list.columns()[i]] = flown.values[i];
  return values;
}

MeasuredFlight fly_all(const config::Scenario& scenario, const config::Scenario& base,
                       bool certify = false) {
  return fly_measured(scenario, MeasureList(base, kAll), fly_base(base), certify);
}

// --- measures, second implementation -------------------------------------------------------------

/// One column over some steps of a flight.
using Column = std::vector<double>;

double calc_rms(const Column& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double calc_max(const Column& values) {
  double largest = 0.0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  return largest;
}

/// Time after which `values` stays within 2 % of the step; searched from the end.
double calc_settling(const Column& time, const Column& values, double target) {
  const double step = target - values.front();
  if (std::abs(step) < 0.01) return std::nan("");
  std::size_t settled = values.size();
  while (settled > 0 && std::abs(values[settled - 1] - target) <= 0.02 * std::abs(step)) --settled;
  return settled == values.size() ? std::numeric_limits<double>::infinity()
                                  : time[settled] - time.front();
}

double calc_overshoot(const Column& values, double target) {
  const double step = target - values.front();
  if (std::abs(step) < 0.01) return std::nan("");
  double most = 0.0;
  for (const double value : values) most = std::max(most, (value - target) / step);
  return most;
}

/// All measures of a flight, from its stored steps.
std::map<std::string, double> calc_measures(const std::vector<model::StepRecord>& steps,
                                            const config::Scenario& scenario) {
  const double period = static_cast<double>(scenario.sync.period_ns) / 1e9;
  std::map<std::string, double> values;
  const char* axes = "xyz";
  const auto calc_errors = [&](const std::string& prefix,
                               const std::vector<model::StepRecord>& of) {
    for (int axis = 0; axis < 3; ++axis) {
      Column errors;
      for (const model::StepRecord& step : of)
        errors.push_back(step.truth.p_WL[axis] - step.answer.reference.position[axis]);
      const std::string suffix = std::string("_") + axes[axis] + "_m";
      values[prefix + "load_error_rms" + suffix] = of.empty() ? std::nan("") : calc_rms(errors);
      values[prefix + "load_error_max" + suffix] = of.empty() ? std::nan("") : calc_max(errors);
    }
  };
  calc_errors("", steps);
  Column norms, forces, tilts;
  for (const model::StepRecord& step : steps) {
    norms.push_back((step.truth.p_WL - step.answer.reference.position).norm());
    forces.push_back(step.answer.f_Q_W.norm());
    // From the rod's angles; the code under test uses the positions of the bodies.
    const double cosine = std::cos(step.truth.rod.alpha) * std::cos(step.truth.rod.beta);
    tilts.push_back(std::acos(std::min(cosine, 1.0)));
  }
  values["load_error_rms_m"] = calc_rms(norms);
  values["load_error_max_m"] = calc_max(norms);
  values["force_max_n"] = calc_max(forces);
  values["tilt_max_rad"] = calc_max(tilts);
  for (std::size_t stage = 0; stage < scenario.mission.size(); ++stage) {
    const std::string prefix = "stage_" + std::to_string(stage) + "_";
    std::vector<model::StepRecord> of;
    for (const model::StepRecord& step : steps)
      if (step.answer.stage == stage) of.push_back(step);
    calc_errors(prefix, of);
    const auto* constant =
        std::get_if<config::ConstantReference>(&scenario.mission[stage].reference);
    if (!constant) continue;
    for (int axis = 0; axis < 3; ++axis) {
      Column time, position;
      for (const model::StepRecord& step : of) {
        time.push_back(static_cast<double>(step.step) * period);
        position.push_back(step.truth.p_WL[axis]);
      }
      const std::string letter(1, axes[axis]);
      const double target = constant->position[axis];
      values[prefix + "settling_" + letter + "_s"] =
          of.empty() ? std::nan("") : calc_settling(time, position, target);
      values[prefix + "overshoot_" + letter] =
          of.empty() ? std::nan("") : calc_overshoot(position, target);
    }
  }
  return values;
}

void expect_equal_measures(const std::map<std::string, double>& ours,
                           const std::map<std::string, double>& theirs) {
  for (const auto& [name, value] : theirs) {
    ASSERT_EQ(ours.count(name), 1u) << name;
    if (!std::isfinite(value))
      EXPECT_TRUE(std::isnan(value) ? std::isnan(ours.at(name)) : ours.at(name) == value)
          << name << ": " << ours.at(name) << ", expected " << value;
    else  // sums in another order; acos loses digits near 1
      EXPECT_NEAR(ours.at(name), value, name == "tilt_max_rad" ? 1e-8 : 1e-12 * (1 + value))
          << name;
  }
}

void expect_measures_of_its_columns(const config::Scenario& scenario,
                                    const config::Scenario& base) {
  const MeasuredFlight flown = fly_all(scenario, base);
  std::vector<model::StepRecord> steps = fly(scenario);
  ASSERT_GE(steps.size(), flown.steps);
  steps.resize(flown.steps);  // the steps up to the loss
  auto theirs = calc_measures(steps, scenario);
  theirs["time_of_loss_s"] = flown.outcome == Outcome::kFinished
                                 ? std::nan("")
                                 : 1e-9 * static_cast<double>(scenario.sync.period_ns) *
                                       static_cast<double>(steps.back().step);
  const auto ours = name_values(base, flown);
  EXPECT_EQ(ours.size(), theirs.size());
  expect_equal_measures(ours, theirs);
}

TEST(FlightMeasuresTest, AreThoseOfTheStoredColumnsOfAFlightThatFinishes) {
  for (const char* name : {"setpoints", "short", "rest_to_rest", "faulty_figure_eight"}) {
    SCOPED_TRACE(name);
    const config::Scenario scenario = load(name);
    expect_measures_of_its_columns(scenario, scenario);
  }
}

TEST(FlightMeasuresTest, AreThoseUpToTheLoss) {
  const config::Scenario base = load("figure_eight");
  expect_measures_of_its_columns(delay_command(base, 65), base);  // loses the load at 20.396 s
}

TEST(FlightMeasuresTest, CoverTheFlightUpToTheFailureOnly) {
  const config::Scenario base = load("setpoints");
  // The state freezes half a second after the second set point begins.
  const config::Scenario frozen = load_changed(
      "setpoints", {{"faults", "[{ freeze: { on: state, from_s: 15.5, to_s: 40 } }]"}});
  EXPECT_NE(fly_all(frozen, base).outcome, Outcome::kFinished);
  expect_measures_of_its_columns(frozen, base);
  // The second stage never ends: its radius is too small.
  const config::Scenario stuck =
      load_changed("setpoints", {{"mission.1",
                                  "{ set_point: { position_m: [-1, -1, -4] }, until: { after_s: "
                                  "1, within_m: 1.0e-9, timeout_s: 2 } }"}});
  const MeasuredFlight flown = fly_all(stuck, base);
  EXPECT_EQ(flown.outcome, Outcome::kFailed);
  EXPECT_EQ(flown.reason,
            "controller 'control_client' answered step 4250 with a fault: stage_timeout, at 17 s");
  expect_measures_of_its_columns(stuck, base);
}

TEST(FlightMeasuresTest, ListsColumnsInTheOrderOfTheMeasures) {
  const config::Scenario base = load("mission");  // its stage 4 is a figure eight
  std::vector<std::string> expected = {"time_of_loss_s", "load_error_rms_m"};
  for (const char* part :
       {"", "stage_0_", "stage_1_", "stage_2_", "stage_3_", "stage_4_", "stage_5_"})
    for (const char* axis : {"x", "y", "z"})
      expected.push_back(std::string(part) + "load_error_rms_" + axis + "_m");
  EXPECT_EQ(MeasureList(base, {"time_of_loss", "outcome", "load_error_rms"}).columns(), expected);
  const auto settling = MeasureList(base, {"settling"}).columns();
  EXPECT_EQ(settling.size(), 15u);
  EXPECT_EQ(settling.front(), "stage_0_settling_x_s");
  EXPECT_EQ(settling.back(), "stage_5_settling_z_s");
  EXPECT_EQ(MeasureList(base, {"overshoot"}).columns()[3], "stage_1_overshoot_x");
}

TEST(FlightMeasuresTest, AnUnknownMeasureIsRefusedWithTheListOfThose) {
  EXPECT_EQ(sls::test::find_error<config::ConfigError>(
                [] { MeasureList(load("short"), {"load_error_mean"}); }),
            "measure: expected load_error_rms, load_error_max, settling, overshoot, tilt_max, "
            "force_max, time_of_loss, load_error_end, quad_error_rms, quad_error_max, "
            "quad_error_end, attitude_max, energy_max or outcome, got 'load_error_mean'");
}

// --- outcome -------------------------------------------------------------------------------------

/// Flies each delay of a delay margin of vehicle 0 again as a run of a campaign; expects the same
/// outcome.
void expect_outcomes_of_delay_margin(const config::Scenario& scenario) {
  const FlightErrors base = fly_base(scenario);
  const MeasureList list(scenario, {"load_error_max", "load_error_rms"});
  int lost = 0, failed = 0;
  for (const DelayedFlight& delayed : find_delay_margin(scenario, 0).flights) {
    SCOPED_TRACE(delayed.periods);
    const MeasuredFlight flown =
        fly_measured(delay_command(scenario, delayed.periods), list, base, false);
    lost += flown.outcome == Outcome::kLost ? 1 : 0;
    failed += flown.outcome == Outcome::kFailed ? 1 : 0;
    std::string reason = flown.reason;
    const std::string comparison = "in the base flight";
    if (const auto found = reason.find(comparison); found != std::string::npos)
      reason.replace(found, comparison.size(), "without delay");
    EXPECT_EQ(reason, delayed.loss);
    EXPECT_EQ(flown.outcome == Outcome::kFinished, !delayed.is_lost());
    EXPECT_NEAR(flown.values[0], delayed.worst_error, 1e-15 * delayed.worst_error);
    if (scenario.vehicles.size() > 1) continue;  // here the rms of all, there the largest
    const auto rms = static_cast<std::size_t>(
        std::find(list.columns().begin(), list.columns().end(), "load_error_rms_m") -
        list.columns().begin());
    EXPECT_NEAR(flown.values[rms], delayed.rms_error, 1e-12 * delayed.rms_error);
  }
  EXPECT_GT(lost + failed, 0);
}

TEST(MeasuredFlightTest, LosesTheLoadByTheRuleOfTheDelayMargin) {
  expect_outcomes_of_delay_margin(load("figure_eight"));
  expect_outcomes_of_delay_margin(load("matlab_setpoint_3"));
  expect_outcomes_of_delay_margin(load_short_team());
}

TEST(MeasuredFlightTest, MeasuresDoNotDependOnTheCertificate) {
  const config::Scenario base = load("figure_eight"), scenario = delay_command(base, 65);
  const MeasuredFlight without = fly_all(scenario, base), with = fly_all(scenario, base, true);
  EXPECT_EQ(without.outcome, Outcome::kLost);
  EXPECT_EQ(with.outcome, Outcome::kLost);
  EXPECT_EQ(with.reason, without.reason);
  EXPECT_LT(without.steps, with.steps);  // with a certificate it flies to the end
  EXPECT_EQ(with.steps, 8001u);
  EXPECT_TRUE(without.certificate.empty());
  const auto a = name_values(base, without), b = name_values(base, with);
  for (const auto& [name, value] : a)
    EXPECT_TRUE(value == b.at(name) || std::isnan(value)) << name << ": " << value;
}

TEST(MeasuredFlightTest, OfSeveralVehiclesEachMeasureIsTheLargest) {
  const config::Scenario team = load_short_team();
  Flight flight(team, list_vehicles(team));
  std::vector<std::vector<model::StepRecord>> flown(3);
  while (flight.fly_step())
    for (std::size_t i = 0; i < 3; ++i) flown[i].push_back(flight.steps()[i]);
  std::map<std::string, double> largest = {{"time_of_loss_s", std::nan("")}};
  for (std::uint32_t id = 0; id < 3; ++id)
    for (const auto& [name, value] :
         calc_measures(flown[id], config::make_vehicle_scenario(team, id))) {
      const auto found = largest.emplace(name, value).first;
      if (std::isnan(found->second) || value > found->second) found->second = value;
    }
  const auto ours = name_values(team, fly_all(team, team));
  EXPECT_EQ(ours.size(), largest.size());
  expect_equal_measures(ours, largest);
  EXPECT_TRUE(std::isfinite(ours.at("stage_0_settling_x_s")));
}

TEST(MeasuredFlightTest, AnotherNumberOfVehiclesThanInTheBaseIsRefused) {
  EXPECT_EQ(sls::test::find_error<config::ConfigError>(
                [] { fly_all(load("mixed_fleet"), load("short")); }),
            "vehicles: expected 1, as in the base scenario, got 4");
}

TEST(MeasuredFlightTest, PollsDuringTheFlightAndStopsWhenThePollThrows) {
  const config::Scenario scenario = load("short");
  struct Stop {};
  int calls = 0;
  const Poll poll = [&] {
    if (++calls == 3) throw Stop();
  };
  EXPECT_THROW(
      fly_measured(scenario, MeasureList(scenario, kAll), fly_base(scenario), false, {}, poll),
      Stop);
}

// --- certificate ---------------------------------------------------------------------------------

struct Certified {
  const char* name;
  const char* scenario;
  Values values;
  bool is_complete = true;  ///< The flight finishes, and its recording is complete.
};

void PrintTo(const Certified& certified, std::ostream* out) { *out << certified.name; }

const Values kTwoSeconds = {{"mission.0.for_s", "2"}};

const std::vector<Certified> kCertified = {
    {"SlungLoad", "short", {}},
    {"Analytic",
     "figure_eight",
     {{"plant", "{ model: analytic, step_s: 0.004, initial: { load_position_m: [0, 0, -0.5] } }"}}},
    {"MultirotorWithPx4", "multirotor_setpoints", {{"mission.0.for_s", "2"}}},
    {"PublishedChainWithSensing", "px4_published", {}},
    {"FaultsAndNoise", "faulty_figure_eight", {}},
    {"StagesLeftByRadius", "mission", {}},
    {"LongStageName", "short", {{"mission.0.name", "a stage with a name of 31 chars"}}},
    {"AnotherLaw", "figure_eight_pid", kTwoSeconds},
    {"GroupOnOneLoad", "one_controller_dies", {{"mission.0.for_s", "1"}}},
    {"GroupLosesACable", "one_controller_dies", {{"plant.cables.0.release_s", "1"}}},
    {"RefusedForce", "figure_eight", {{"controller.force_limit_n", "10"}}, false},
    {"ControllerFault",
     "short",
     {{"mission.0", "{ set_point: { position_m: [0, 0, 100] }, for_s: 2 }"}},
     false},
    {"PlantNotFinite",
     "short",
     {{"faults", "[{ bias: { on: command, force_n: [1.0e+300, 0, 0], from_s: 1 } }]"}},
     false},
    {"LostLoad", "figure_eight", {{"faults", "[{ delay: { on: command, by_s: 0.26 } }]"}}},
};

class CertificateOfFlightTest : public ::testing::TestWithParam<Certified> {};

TEST_P(CertificateOfFlightTest, IsThatOfItsRecording) {
  const config::Scenario base = load(GetParam().scenario);
  const config::Scenario scenario = load_changed(GetParam().scenario, GetParam().values);
  const TemporaryFolder folder;
  const FlightEnd end = fly_recorded(scenario, {}, folder / "recording", false);
  EXPECT_EQ(end.is_complete, GetParam().is_complete) << end.failure;
  const std::string recorded = record::read_manifest(folder / "recording").certificate;
  const MeasuredFlight flown = fly_all(scenario, base, true);
  EXPECT_EQ(flown.certificate, recorded);
  EXPECT_EQ(flown.steps, end.last_step + 1);
  EXPECT_EQ(flown.certificate.size(), 64u);
}

INSTANTIATE_TEST_SUITE_P(Scenarios, CertificateOfFlightTest, ::testing::ValuesIn(kCertified),
                         [](const auto& certified) { return std::string(certified.param.name); });

TEST(LibraryOfFlightTest, TheManifestHasTheHashOfTheLaw) {
  const std::string law = SLS_LIBRARIES "/controller.so";
  const config::Scenario scenario =
      load_changed("short", {{"controller", "{ law: " + law + ", force_limit_n: 200 }"}});
  const TemporaryFolder folder;
  fly_recorded(scenario, {}, folder / "recording", false);
  const std::string manifest = sls::test::read_bytes(folder / "recording/manifest.json");
  EXPECT_NE(manifest.find("\"control_client\": \"" + text::calc_file_sha256(law) + "\""),
            manifest.npos)
      << manifest;
}

// --- runs ----------------------------------------------------------------------------------------

TEST(CampaignRunsTest, ARunIsTheScenarioOfItsText) {
  const TemporaryFolder folder;
  const CampaignRuns runs(file_of("short"), {"vehicle.load_mass_kg", "mission.0.for_s"}, kAll);
  const config::Scenario scenario = runs.make_scenario({"0.3", "1"});
  EXPECT_EQ(scenario.vehicle.load_mass, 0.3);
  sls::test::write_bytes(folder / "run.yaml", scenario.text);
  const config::Scenario again = config::load_scenario(folder / "run.yaml");
  EXPECT_EQ(config::to_yaml(again), config::to_yaml(scenario));
  const MeasuredFlight flown = runs.fly({"0.3", "1"}, true);
  EXPECT_EQ(flown.steps, 251u);
  fly_recorded(again, {}, folder / "recording", false);
  EXPECT_EQ(flown.certificate, record::read_manifest(folder / "recording").certificate);
  EXPECT_NE(runs.fly({"0.2", "1"}, true).certificate, flown.certificate);
  EXPECT_EQ(runs.fly({"0.3", "1"}, true).certificate, flown.certificate) << "a run is repeatable";
}

TEST(CampaignRunsTest, AnotherPeriodIsInEachRunsText) {
  const CampaignRuns runs(file_of("short"), {"vehicle.load_mass_kg"}, kAll, 0.02);
  const config::Scenario run = runs.make_scenario({"0.2"});
  EXPECT_EQ(run.sync.period_ns, 20'000'000);
  EXPECT_EQ(run.plant.step_ns, 1'000'000);
  EXPECT_EQ(config::parse_scenario(run.text, "text").sync.period_ns, 20'000'000);
  EXPECT_EQ(runs.fly({"0.2"}, false).steps, 101u);
  const CampaignRuns fine(file_of("short"), {}, kAll, 0.0005);
  EXPECT_EQ(fine.make_scenario({}).plant.step_ns, 500'000);
}

/// The error of the runs of `file` that vary `path`: of their constructor, or of `work` on them.
template <class Work>
std::string find_error(const std::filesystem::path& file, const std::string& path,
                       const Work& work) {
  const std::string place = file.string(), text = sls::test::find_error<config::ConfigError>([&] {
                                             work(CampaignRuns(file, {path}, {"outcome"}));
                                           });
  return text.rfind(place, 0) == 0 ? "FILE" + text.substr(place.size()) : text;
}

TEST(CampaignRunsTest, MistakesNameFileAndKey) {
  const auto check = [](const char* value) {
    return [value](const CampaignRuns& runs) { runs.check({value}); };
  };
  const auto file = file_of("short");
  EXPECT_EQ(find_error(file, "vehicle.load_mass_kg", check("0.3")), "no error");
  EXPECT_EQ(find_error(file, "vehicle.load_mass_kg", check("-0.3")),
            "FILE:3: vehicle.load_mass_kg: expected > 0, got -0.3");
  EXPECT_EQ(find_error(file, "vehicle.load_mas_kg", check("0.3")).substr(0, 25),
            "FILE:3: vehicle.load_mas_");
  EXPECT_EQ(find_error(file, "vehicles", check("2")),
            "FILE: vehicles: expected 1, as in the base scenario, got 2");
  EXPECT_EQ(find_error(file_of("mixed_fleet"), "vehicle.load_mass_kg", check("0.3")), "no error");
  EXPECT_EQ(find_error(file, "vehicle.load_mass_kg",
                       [](const CampaignRuns& runs) {
                         runs.check({"1", "2"});
                       }),
            "expected 1 values, one for each path, got 2");
}

TEST(CampaignRunsTest, ABaseScenarioThatFailsIsRefused) {
  const TemporaryFolder folder;
  const auto file = folder / "base.yaml";
  sls::test::write_bytes(file,
                         load_changed("figure_eight", {{"controller.force_limit_n", "10"}}).text);
  const std::string error = find_error(file, "vehicle.load_mass_kg", [](const CampaignRuns&) {});
  EXPECT_EQ(error.find("FILE: the base scenario fails, and by its flight the others would be "
                       "judged: controller 'control_client' answered step 0 with a force beyond "
                       "controller.force_limit_n: "),
            0u)
      << error;
  EXPECT_EQ(error.substr(error.size() - 8), ", at 0 s") << error;
}

}  // namespace
}  // namespace sls::closed_loop::test
