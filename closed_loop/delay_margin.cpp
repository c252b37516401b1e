#include "closed_loop/delay_margin.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <variant>

#include "closed_loop/flight.hpp"
#include "closed_loop/loss.hpp"
#include "common/config/numbers.hpp"
#include "common/model/measures.hpp"

namespace sls::closed_loop {
namespace {

constexpr std::int64_t kLongestDelay = 10'000'000'000;  // ns
constexpr std::int64_t kMostPeriods = 100'000;          // samples that a delay keeps in memory

using Ids = std::vector<std::uint32_t>;

/// `scenario` with the commands of `vehicles` delayed by `periods`, after its own faults.
config::Scenario make_delayed(config::Scenario scenario, const Ids& vehicles,
                              std::int64_t periods) {
  config::Fault fault;
  fault.kind = "delay";
  fault.on = config::FaultChannel::kCommand;
  fault.effect = config::DelayFault{periods * scenario.sync.period_ns};
  for (const std::uint32_t vehicle : vehicles) {
    fault.vehicle = static_cast<int>(vehicle);
    scenario.faults.push_back(fault);  // last: random numbers depend on a fault's place
  }
  return scenario;
}

/// Delay of the vehicle's loop that the scenario itself has during the whole flight.
std::int64_t calc_own_delay(const config::Scenario& scenario, std::uint32_t vehicle) {
  std::int64_t own_ns = scenario.sensing.node_delay_ns;
  const config::Fault always;
  for (const config::Fault& fault : scenario.faults) {
    const auto* delay = std::get_if<config::DelayFault>(&fault.effect);
    if (delay && fault.vehicle == static_cast<int>(vehicle) && fault.from_ns == always.from_ns &&
        fault.to_ns == always.to_ns)
      own_ns += delay->by_ns;
  }
  return own_ns;
}

std::int64_t calc_common_own_delay(const config::Scenario& scenario, const Ids& vehicles) {
  const std::int64_t own_ns = calc_own_delay(scenario, vehicles.front());
  const bool are_alike = std::all_of(vehicles.begin(), vehicles.end(), [&](std::uint32_t vehicle) {
    return calc_own_delay(scenario, vehicle) == own_ns;
  });
  return are_alike ? own_ns : 0;
}

/// Flies until the end or the loss. `judge` gets each step of all vehicles and returns the reason
/// if a load is lost at it, else an empty text.
template <class Judge>
DelayedFlight fly(const config::Scenario& scenario, std::int64_t periods, const Judge& judge) {
  Flight flight(scenario, list_vehicles(scenario));
  DelayedFlight result;
  result.periods = periods;
  model::ErrorStatistics errors;
  std::uint64_t count = 0;
  while (flight.fly_step()) {
    ++count;
    for (const model::StepRecord& step : flight.steps())
      errors.add(step.truth.p_WL - step.answer.reference.position);
    result.loss = judge(flight.steps());
    if (result.is_lost()) break;
  }
  if (!result.is_lost()) result.loss = flight.failure();
  if (result.is_lost())
    result.loss += describe_time(calc_last_time_ns(count, scenario.sync.period_ns));
  result.worst_error = errors.calc_max(model::kNorm);
  result.rms_error = errors.calc_rms(model::kNorm);
  return result;
}

/// The flight without added delay, with which the others are compared.
DelayedFlight fly_undelayed(const config::Scenario& scenario, FlightErrors& errors) {
  DelayedFlight result = fly(scenario, 0, [&](const std::vector<model::StepRecord>& steps) {
    add_errors(steps, errors);
    return std::string();
  });
  if (result.is_lost())
    throw std::runtime_error("the load is lost without any added delay: " + result.loss);
  return result;
}

DelayedFlight fly_delayed(const config::Scenario& scenario, const Ids& vehicles,
                          std::int64_t periods, const FlightErrors& undelayed) {
  const LossRule rule(scenario, undelayed, "without delay");
  return fly(make_delayed(scenario, vehicles, periods), periods,
             [&](const std::vector<model::StepRecord>& steps) { return rule.judge(steps); });
}

std::string to_seconds_text(std::int64_t nanoseconds) {
  return config::to_text(config::to_seconds(nanoseconds));
}

}  // namespace

const DelayedFlight* DelayMargin::shortest_lost() const {
  const auto lost = std::find_if(flights.begin(), flights.end(),
                                 [](const DelayedFlight& flight) { return flight.is_lost(); });
  return lost == flights.end() ? nullptr : &*lost;
}

const DelayedFlight* DelayMargin::longest_held() const {
  const DelayedFlight* held = nullptr;
  for (const DelayedFlight& flight : flights) {
    if (flight.is_lost()) break;
    held = &flight;
  }
  return held;
}

DelayMargin find_delay_margin(const config::Scenario& scenario,
                              std::optional<std::uint32_t> vehicle,
                              const std::function<void(const DelayedFlight&)>& after_flight) {
  const std::size_t count = scenario.vehicles.size();
  if (vehicle && *vehicle >= count)
    throw config::ConfigError("--vehicle: expected one of " + scenario.name + ", 0 to " +
                              std::to_string(count - 1) + ", got " + std::to_string(*vehicle));
  const Ids vehicles = vehicle ? Ids{*vehicle} : list_vehicles(scenario);
  DelayMargin margin;
  margin.period_ns = scenario.sync.period_ns;
  margin.own_ns = calc_common_own_delay(scenario, vehicles);
  const auto add = [&](const DelayedFlight& flight) {
    margin.flights.push_back(flight);
    if (after_flight) after_flight(flight);
    return flight.is_lost();
  };
  FlightErrors undelayed;
  add(fly_undelayed(scenario, undelayed));
  const auto is_lost_with = [&](std::int64_t periods) {
    return add(fly_delayed(scenario, vehicles, periods, undelayed));
  };

  const std::int64_t most =
      std::clamp<std::int64_t>(kLongestDelay / margin.period_ns, 1, kMostPeriods);
  std::int64_t held = 0, lost = 1;
  while (!is_lost_with(lost)) {
    held = lost;
    if (held == most) break;
    lost = std::min(2 * lost, most);
  }
  while (lost - held > 1) {
    const std::int64_t middle = held + (lost - held) / 2;
    (is_lost_with(middle) ? lost : held) = middle;
  }
  std::sort(margin.flights.begin(), margin.flights.end(),
            [](const DelayedFlight& a, const DelayedFlight& b) { return a.periods < b.periods; });
  return margin;
}

std::string to_text(const DelayMargin& margin) {
  std::string text = fmt::format("{:>9} {:>8} {:>15} {:>13}  {}\n", "delay (s)", "periods",
                                 "worst error (m)", "rms error (m)", "outcome");
  for (const DelayedFlight& flight : margin.flights)
    text += fmt::format("{:>9} {:>8} {:>15.6f} {:>13.6f}  {}\n",
                        to_seconds_text(flight.periods * margin.period_ns), flight.periods,
                        flight.worst_error, flight.rms_error,
                        flight.is_lost() ? "lost: " + flight.loss : "held");
  const DelayedFlight* lost = margin.shortest_lost();
  const auto describe = [&](std::int64_t own_ns) {
    const auto to_whole = [&](const DelayedFlight& flight) {
      return to_seconds_text(own_ns + flight.periods * margin.period_ns);
    };
    return "holds with " + to_whole(*margin.longest_held()) + " s, " +
           (lost ? "loses the load with " + to_whole(*lost) + " s\n"
                 : "the longest delay tried: the load was never lost\n");
  };
  text += describe(0);
  if (margin.own_ns > 0)
    text += "with the scenario's own delay of " + to_seconds_text(margin.own_ns) +
            " s: " + describe(margin.own_ns);
  return text;
}

}  // namespace sls::closed_loop
