#include "recorder/flight_log.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "common/bus/convert.hpp"
#include "tests/recorder/synthetic_run.hpp"
#include "tests/support/text.hpp"

namespace sls::record {
namespace {

using namespace test;

StepRows make_rows(std::uint64_t step) {
  StepRows rows;
  bus::fill(rows, make_entry(step));
  fill_columns(rows, make_row_format(make_parameters()));
  return rows;
}

Eigen::Vector3d calc_error(std::uint64_t step) {
  const StepRows rows = make_rows(step);
  return rows.truth.p_WL - rows.answer.reference.position;
}

/// rms, largest and last error over the steps [from, to], from a direct sum.
struct Expected {
  Eigen::Vector3d rms, max;
  double at_end = 0;
};
Expected calc_expected(std::uint64_t from, std::uint64_t to) {
  Expected expected;
  for (int axis = 0; axis < 3; ++axis) {
    long double sum = 0;
    expected.max[axis] = 0;
    for (std::uint64_t step = from; step <= to; ++step) {
      const double error = calc_error(step)[axis];
      sum += static_cast<long double>(error) * error;
      expected.max[axis] = std::max(expected.max[axis], std::abs(error));
    }
    expected.rms[axis] =
        std::sqrt(static_cast<double>(sum / static_cast<long double>(to - from + 1)));
  }
  expected.at_end = calc_error(to).norm();
  return expected;
}

std::string write(const FlightLog& log) {
  std::ostringstream out;
  log.write(out);
  return out.str();
}

/// The seven numbers of the line that begins with `label`, or of a stage in the line after it.
std::vector<double> find_numbers(const std::string& text, const std::string& label) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const auto begin = line.find_first_not_of(' ');
    if (begin == std::string::npos || line.compare(begin, label.size(), label) != 0) continue;
    EXPECT_LE(line.size(), 80u) << line;
    const bool is_stage = label[0] >= '0' && label[0] <= '9';
    if (is_stage) std::getline(lines, line);
    std::istringstream words(line.substr(is_stage ? line.find("all") + 3 : begin + label.size()));
    std::vector<double> numbers;
    for (double number; words >> number;) numbers.push_back(number);
    if (numbers.size() >= 7) return {numbers.end() - 7, numbers.end()};
  }
  return {};
}

void expect_statistics(const std::string& text, const std::string& label,
                       const Expected& expected) {
  SCOPED_TRACE(label);
  const auto numbers = find_numbers(text, label);
  ASSERT_EQ(numbers.size(), 7u) << text;
  // Printed with three digits.
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(numbers[static_cast<std::size_t>(axis)], expected.rms[axis],
                6e-3 * expected.rms[axis]);
    EXPECT_NEAR(numbers[static_cast<std::size_t>(axis) + 3], expected.max[axis],
                6e-3 * expected.max[axis]);
  }
  EXPECT_NEAR(numbers[6], expected.at_end, 6e-3 * expected.at_end);
}

class FlightLogTest : public testing::Test {
 protected:
  FlightLog log_{config::parse_scenario(kScenarioText, "scenario"), make_parameters()};
};

TEST_F(FlightLogTest, EachStageHasItsErrorsAndTimes) {
  for (std::uint64_t step = 0; step <= kLastStep; ++step) log_.add(make_rows(step));
  const std::string text = write(log_);
  expect_statistics(text, "0 hold", calc_expected(0, 99));
  expect_statistics(text, "1 figure_eight", calc_expected(100, kLastStep));
  EXPECT_NE(text.find("0 hold, 0 s to 0.396 s\n"), std::string::npos) << text;
  EXPECT_NE(text.find("1 figure_eight, 0.4 s to 1.2 s\n"), std::string::npos) << text;
}

TEST_F(FlightLogTest, LapsOfAFigureEightAreSeparateAndTheLastSampleBelongsToTheLastLap) {
  for (std::uint64_t step = 0; step <= kLastStep; ++step) log_.add(make_rows(step));
  const std::string text = write(log_);
  expect_statistics(text, "lap 1", calc_expected(100, 199));
  expect_statistics(text, "lap 2", calc_expected(200, kLastStep));
  EXPECT_EQ(text.find("lap 3"), std::string::npos) << text;
}

TEST(FlightLogLapTest, APartialLastLapIsMarkedAndCountsOnItsOwn) {
  FlightLog log(config::parse_scenario(
                    sls::test::replace_once(kScenarioText, "for_s: 0.8", "for_s: 1"), "scenario"),
                make_parameters());
  for (std::uint64_t step = 100; step <= 350; ++step) log.add(make_rows(step));
  const std::string text = write(log);
  expect_statistics(text, "lap 1 ", calc_expected(100, 199));
  expect_statistics(text, "lap 2 ", calc_expected(200, 299));
  expect_statistics(text, "lap 3 (part)", calc_expected(300, 350));
  EXPECT_EQ(text.find("lap 2 (part)"), std::string::npos) << text;
}

TEST_F(FlightLogTest, LapsOfAStageJoinedLateCountFromItsTrueStart) {
  for (std::uint64_t step = 150; step < 290; ++step) log_.add(make_rows(step));
  const std::string text = write(log_);
  expect_statistics(text, "lap 1 (part)", calc_expected(150, 199));
  expect_statistics(text, "lap 2 (part)", calc_expected(200, 289));
  EXPECT_EQ(log_.list_stage_starts(), std::vector<StageStart>({{0, 1, 100}}));
}

TEST_F(FlightLogTest, LapsThatWereNotRecordedAreNotListed) {
  for (std::uint64_t step = 210; step <= kLastStep; ++step) log_.add(make_rows(step));
  const std::string text = write(log_);
  EXPECT_EQ(text.find("lap 1"), std::string::npos) << text;
  expect_statistics(text, "lap 2 (part)", calc_expected(210, kLastStep));
}

// In doubles 0.7 / 0.1 is less than 7: a lap boundary must not depend on such a rounding.
TEST(FlightLogLapTest, ALapBeginsAtItsFirstSampleWhateverItsPeriod) {
  std::string text = kScenarioText;
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("period_s: 0.4 }", "period_s: 0.1 }");
  replace("for_s: 0.8", "for_s: 1.2");
  FlightLog log(config::parse_scenario(text, "scenario"), make_parameters());
  for (std::uint64_t step = 100; step <= 400; ++step) log.add(make_rows(step > 300 ? 300 : step));
  const std::string out = write(log);
  for (std::uint64_t lap = 0; lap < 8; ++lap)  // 25 steps each
    expect_statistics(out, "lap " + std::to_string(lap + 1) + " ",
                      calc_expected(100 + 25 * lap, 124 + 25 * lap));
}

// The second step is in lap 4,000,001: a list of all laps before it would take 320 MB.
TEST(FlightLogLapTest, LapsOfANanosecondTakeNoMemory) {
  const auto count_resident_pages = [] {
    long total = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> total >> resident;
    return resident;
  };
  const std::string text =
      sls::test::replace_once(kScenarioText, "period_s: 0.4 }", "period_s: 1e-9 }");
  FlightLog log(config::parse_scenario(text, "scenario"), make_parameters());
  const long before = count_resident_pages();
  for (const std::uint64_t step : {100u, 101u}) log.add(make_rows(step));
  ASSERT_LT(count_resident_pages(), before + 8000) << "of 4 kB at least";
  const std::string out = write(log);
  expect_statistics(out, "1 figure_eight", calc_expected(100, 101));
  expect_statistics(out, "lap 1 ", calc_expected(100, 100));
}

TEST_F(FlightLogTest, AStageThatIsFlownAgainIsListedAgain) {
  for (const std::uint64_t step : {0u, 1u, 100u, 101u}) log_.add(make_rows(step));
  StepRows again = make_rows(102);
  again.answer.stage = 0;
  again.answer.stage_name = "hold";
  log_.add(again);
  const std::string text = write(log_);
  const auto first = text.find("0 hold");
  EXPECT_NE(text.find("0 hold", first + 1), std::string::npos) << text;
}

TEST_F(FlightLogTest, IncompleteStepsSayNothingAboutErrors) {
  for (std::uint64_t step = 0; step < 100; ++step) {
    StepRows rows = make_rows(step);
    if (step % 3 == 0) rows.has_state = false;
    if (step % 3 == 1) rows.has_reference = false;
    if (step % 3 == 2) rows.has_command = false;
    log_.add(rows);
  }
  EXPECT_EQ(write(log_).find("0 hold"), std::string::npos);
}

TEST_F(FlightLogTest, AStageTheScenarioDoesNotHaveIsListedWithoutLaps) {
  StepRows rows = make_rows(0);
  rows.answer.stage = 4000000000u;
  log_.add(rows);
  const std::string text = write(log_);
  EXPECT_NE(text.find("4000000000"), std::string::npos) << text;
  EXPECT_EQ(text.find("lap 1"), std::string::npos) << text;
}

TEST_F(FlightLogTest, ListsStagesAndEvents) {
  log_.add(make_status(RunPhase::PHASE_WAITING, 0, "missing: recorder"));
  log_.add(make_status(RunPhase::PHASE_WAITING, 0, "missing: recorder"));
  log_.add(make_status(RunPhase::PHASE_RUNNING, 0));
  log_.add(make_status(RunPhase::PHASE_RUNNING, 50));
  log_.add(make_status(RunPhase::PHASE_FINISHED, kLastStep, "mission\nfinished"));
  log_.add_event("recorder: all is well");
  const std::string text = write(log_);
  for (const char* part :
       {"synthetic: finished", "0123456789abcdef", "quadrotor 1.5 kg", "load 0.2 kg", "rod 1 m",
        "9.8 m/s²", "period 0.004 s", "step 0.001 s", "lockstep", "300 steps", "1.2 s simulated",
        "states resent 11", "fault 12", "timing: exact", "fail-safe 0", "round trip p50 81.2 µs",
        "recorder: all is well", "step 300 (1.2 s)", "mission\\x0afinished"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  const auto events = text.substr(text.find("Events\n") + 7);
  EXPECT_EQ(std::count(events.begin(), events.end(), '\n'), 4) << events;
}

// A link that fails every few seconds for days.
TEST_F(FlightLogTest, OfManyEventsTheFirstAndTheLastAreListed) {
  for (int i = 0; i < 5000; ++i)
    log_.add(make_status(RunPhase::PHASE_RUNNING, 0, "event " + std::to_string(i) + "."));
  const std::string text = write(log_);
  const auto events = text.substr(text.find("Events\n") + 7);
  EXPECT_EQ(std::count(events.begin(), events.end(), '\n'), 1001);
  for (const char* part : {"event 0.", "event 499.", "event 4500.", "event 4999.",
                           "\n  (4000 events left out here; status.csv has them)\n"})
    EXPECT_NE(events.find(part), std::string::npos) << part;
  for (const char* part : {"event 500.", "event 4499."})
    EXPECT_EQ(events.find(part), std::string::npos) << part;
}

TEST_F(FlightLogTest, StagesOfAControllerThatChangesThemAtEveryStepAreCounted) {
  StepRows rows = make_rows(0);
  for (std::uint64_t step = 0; step < 5000; ++step) {
    rows.step = step;
    rows.answer.stage = static_cast<std::uint32_t>(step % 2);
    log_.add(rows);
  }
  const std::string text = write(log_);
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 3100)
      << "two lines of a stage, one of its lap";
  EXPECT_NE(text.find("  (4000 more stages)\n"), std::string::npos);
}

}  // namespace
}  // namespace sls::record
