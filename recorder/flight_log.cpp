#include "recorder/flight_log.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <variant>

#include "common/bus/names.hpp"
#include "common/bus/sync_counters.hpp"
#include "common/text/printable.hpp"

namespace sls::record {
namespace {

/// Limit of the listed laps of one stage, because of memory and lines. Usual flights have fewer.
constexpr std::size_t kMaxLaps = 1000;

/// The same of the stages of one vehicle: a faulty controller can begin a new one at every step.
constexpr std::size_t kMaxStages = 1000;

/// Limit of the listed events: a link that is bad for days causes new ones every few seconds.
constexpr std::size_t kMaxEvents = 1000;

/// A row of at most 80 columns.
std::string format_errors(const std::string& label, const model::ErrorStatistics& errors) {
  return fmt::format("  {:<13} {:8.2e} {:8.2e} {:8.2e} {:8.2e} {:8.2e} {:8.2e} {:8.2e}\n", label,
                     errors.calc_rms(0), errors.calc_rms(1), errors.calc_rms(2), errors.calc_max(0),
                     errors.calc_max(1), errors.calc_max(2), errors.calc_end(model::kNorm));
}

std::int64_t calc_lap_ns(const config::Stage& stage) {
  const auto& eight = std::get<config::FigureEightReference>(stage.reference);
  // Whole nanoseconds, because the rounded quotient of seconds can be just below the next lap.
  return std::max<std::int64_t>(std::llround(eight.period_s * 1e9), 1);
}

}  // namespace

FlightLog::FlightLog(const config::Scenario& scenario, const Parameters& parameters)
    : scenario_(scenario), parameters_(parameters) {}

double FlightLog::to_time(std::uint64_t step) const {
  return static_cast<double>(step) * static_cast<double>(parameters_.period_ns()) / 1e9;
}

FlightLog::Stage* FlightLog::find_or_begin_stage(const StepRows& rows) {
  auto& [stages, left_out, current] = stages_[rows.vehicle_id];
  const std::uint32_t index = rows.answer.stage;
  const bool begins = current != index;
  current = index;
  if (begins && stages.size() == kMaxStages) ++left_out;
  if (left_out > 0) return nullptr;
  if (begins) {
    Stage stage;
    stage.name = rows.answer.stage_name;
    stage.first_step = rows.step;
    stage.start_step = find_start(rows.vehicle_id, index, rows.step);
    stages.emplace_back(index, stage);
  }
  Stage& stage = stages.back().second;
  stage.start_step = rows.stage_start_step.value_or(stage.start_step);
  return &stage;
}

std::uint64_t FlightLog::find_start(std::uint32_t vehicle_id, std::uint32_t index,
                                    std::uint64_t first_step) const {
  for (const StageStart& start : known_starts_)
    if (start.vehicle_id == vehicle_id && start.stage == index)
      return std::min(start.step, first_step);
  return first_step;
}

std::vector<StageStart> FlightLog::list_stage_starts() const {
  std::vector<StageStart> starts;
  for (const auto& [vehicle_id, stages] : stages_)
    for (const auto& [index, stage] : stages.listed)
      if (stage.start_step != stage.first_step)
        starts.push_back({vehicle_id, index, stage.start_step});
  return starts;
}

std::int64_t FlightLog::calc_flown_ns(const Stage& stage, std::uint64_t step) const {
  return static_cast<std::int64_t>(step - stage.start_step) * parameters_.period_ns();
}

/// The last sample of a mission, at the end of its last stage, belongs to the lap that ends there.
std::size_t FlightLog::calc_lap(const Stage& stage, std::size_t index, std::uint64_t step) const {
  const auto& planned = scenario_.mission[index];
  std::int64_t flown_ns = calc_flown_ns(stage, step);
  if (const auto* timed = std::get_if<config::LeaveAfter>(&planned.leave))
    flown_ns = std::min(flown_ns, timed->duration_ns - 1);
  return static_cast<std::size_t>(std::max<std::int64_t>(flown_ns, 0) / calc_lap_ns(planned));
}

/// True if the recorded steps of the stage contain the whole lap.
bool FlightLog::is_whole_lap(const Stage& stage, std::size_t index, std::size_t lap) const {
  const std::int64_t lap_ns = calc_lap_ns(scenario_.mission[index]);
  const std::int64_t begin_ns = static_cast<std::int64_t>(lap) * lap_ns;
  return calc_flown_ns(stage, stage.first_step) < begin_ns + parameters_.period_ns() &&
         calc_flown_ns(stage, stage.last_step + 1) >= begin_ns + lap_ns;
}

void FlightLog::add(const StepRows& rows) {
  if (!rows.is_complete()) return;
  Stage* const listed = find_or_begin_stage(rows);
  if (!listed) return;
  Stage& stage = *listed;
  stage.last_step = rows.step;
  const Eigen::Vector3d error = rows.truth.p_WL - rows.answer.reference.position;
  stage.all.add(error);
  const std::size_t index = rows.answer.stage;
  if (index >= scenario_.mission.size() ||
      !std::holds_alternative<config::FigureEightReference>(scenario_.mission[index].reference))
    return;
  const std::size_t lap = calc_lap(stage, index, rows.step);
  if (lap >= kMaxLaps) return;
  if (lap >= stage.laps.size()) stage.laps.resize(lap + 1);
  stage.laps[lap].add(error);
}

void FlightLog::add(const SimStatus& status, bool is_repeated) {
  const bool is_news = first_events_.empty() || status.phase() != last_status_.phase() ||
                       status.reason() != last_status_.reason();
  last_status_ = status;
  if (is_news && !is_repeated)
    add_event(fmt::format("{}{}{}", bus::to_string(status.phase()),
                          status.reason().size() > 0 ? ": " : "", status.reason().c_str()));
}

void FlightLog::add_event(const std::string& text) {
  std::string line = fmt::format("step {} ({} s): {}", last_status_.step(),
                                 to_time(last_status_.step()), text::escape_controls(text));
  if (first_events_.size() < kMaxEvents / 2) return first_events_.push_back(std::move(line));
  last_events_.push_back(std::move(line));
  if (last_events_.size() <= kMaxEvents / 2) return;
  last_events_.pop_front();
  ++left_out_events_;
}

void FlightLog::write(std::ostream& out) const {
  out << fmt::format("{}: {}\n", text::escape_controls(scenario_.name),
                     bus::to_string(last_status_.phase()));
  out << fmt::format("run {:016x}, scenario SHA-256 {}\n\n", parameters_.run_id(),
                     parameters_.scenario_sha256().c_str());
  const VehicleParameters vehicle =
      parameters_.vehicles().empty() ? VehicleParameters() : parameters_.vehicles().front();
  out << fmt::format(
      "Parameters\n  quadrotor {} kg, load {} kg, rod {} m, gravity {} m/s²\n"
      "  period {} s, step {} s, {}\n",
      vehicle.quad_mass_kg(), vehicle.load_mass_kg(), vehicle.rod_length_m(),
      vehicle.gravity_m_s2(), static_cast<double>(parameters_.period_ns()) / 1e9,
      static_cast<double>(parameters_.step_ns()) / 1e9, bus::to_string(parameters_.mode()));
  const double rate = last_status_.real_time_factor() * 1e9 /
                      static_cast<double>(std::max<std::int64_t>(parameters_.period_ns(), 1));
  out << fmt::format("  {} steps, {} s simulated, {:.0f} steps/s, {:.1f} × real time\n",
                     last_status_.step(), to_time(last_status_.step()), rate,
                     last_status_.real_time_factor());
  out << fmt::format("  timing: {}\n\n",
                     last_status_.timing().size() > 0 ? last_status_.timing().c_str() : "unknown");

  for (const auto& [vehicle_id, stages] : stages_) {
    out << fmt::format(
        "Load position error, vehicle {} (m)\n"
        "{:>24} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}\n",
        vehicle_id, "rms x", "rms y", "rms z", "max x", "max y", "max z", "at end");
    for (const auto& [index, stage] : stages.listed) {
      out << fmt::format("  {} {}, {} s to {} s\n", index, text::escape_controls(stage.name),
                         to_time(stage.first_step), to_time(stage.last_step))
          << format_errors("all", stage.all);
      for (std::size_t lap = 0; lap < stage.laps.size(); ++lap) {
        if (stage.laps[lap].samples() == 0) continue;
        const char* part = is_whole_lap(stage, index, lap) ? "" : " (part)";
        out << format_errors(fmt::format("lap {}{}", lap + 1, part), stage.laps[lap]);
      }
    }
    if (stages.left_out > 0) out << fmt::format("  ({} more stages)\n", stages.left_out);
    out << '\n';
  }

  write_counters(out);
  out << "\nEvents\n";
  for (const auto& event : first_events_) out << "  " << event << '\n';
  if (left_out_events_ > 0)
    out << fmt::format("  ({} events left out here; status.csv has them)\n", left_out_events_);
  for (const auto& event : last_events_) out << "  " << event << '\n';
}

void FlightLog::write_counters(std::ostream& out) const {
  const SyncCounters& counters = last_status_.counters();
  const auto list = [&](const std::string& prefix, std::initializer_list<const char*> words) {
    std::string text;
    for (const bus::Count& count : bus::list_counts(counters, prefix, words))
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count.words, count.value);
    return text + '\n';
  };
  out << "Commands\n  states "
      << list("", {"resent", "duplicate", "superseded", "late", "take-overs"}) << "  "
      << list("", {"stale", "held", "fail-safe", "deadline missed", "overflow", "slipped"})
      << "  rejected: "
      << list("rejected_",
              {"not finite", "force limit", "run", "step", "vehicle", "client", "fault"});
  out << fmt::format("  round trip p50 {:.1f} µs, p99 {:.1f} µs\n",
                     static_cast<double>(last_status_.round_trip_p50_ns()) / 1e3,
                     static_cast<double>(last_status_.round_trip_p99_ns()) / 1e3);
}

}  // namespace sls::record
