#include "closed_loop/delay_margin.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <stdexcept>
#include <variant>

#include "closed_loop/flight.hpp"
#include "closed_loop/loss.hpp"
#include "common/config/numbers.hpp"
#include "common/model/measures.hpp"

namespace sls::closed_loop {
namespace {

constexpr std::int64_t kLongestDelay = 10'000'000'000;  // ns
constexpr std::int64_t kMostPeriods = 100'000;          // samples that a delay keeps in memory

/// `scenario` with its command delayed by `periods`, after its own faults.
config::Scenario make_delayed(config::Scenario scenario, std::int64_t periods) {
  config::Fault fault;
  fault.kind = "delay";
  fault.on = config::FaultChannel::kCommand;
  fault.effect = config::DelayFault{periods * scenario.sync.period_ns};
  scenario.faults.push_back(fault);  // last: random numbers depend on a fault's place
  return scenario;
}

/// Delay of the loop that the scenario itself has during the whole flight.
std::int64_t calc_own_delay(const config::Scenario& scenario) {
  std::int64_t own_ns = scenario.sensing.node_delay_ns;
  const config::Fault always;
  for (const config::Fault& fault : scenario.faults) {
    const auto* delay = std::get_if<config::DelayFault>(&fault.effect);
    if (delay && fault.from_ns == always.from_ns && fault.to_ns == always.to_ns)
      own_ns += delay->by_ns;
  }
  return own_ns;
}

/// Flies until the end or the loss. `judge` returns the reason if the load is lost at this step,
/// else an empty text.
template <class Judge>
DelayedFlight fly(const config::Scenario& scenario, std::int64_t periods, const Judge& judge) {
  Flight flight(make_delayed(scenario, periods));
  DelayedFlight result;
  result.periods = periods;
  model::ErrorStatistics errors;
  while (const auto step = flight.fly_step()) {
    errors.add(step->truth.p_WL - step->answer.reference.position);
    result.loss = judge(*step, calc_load_error(*step));
    if (result.is_lost()) break;
  }
  if (!result.is_lost()) result.loss = flight.failure();
  if (result.is_lost())
    result.loss += describe_time(calc_last_time_ns(errors.samples(), scenario.sync.period_ns));
  result.worst_error = errors.calc_max(model::kNorm);
  result.rms_error = errors.calc_rms(model::kNorm);
  return result;
}

/// The flight without added delay, with which the others are compared.
DelayedFlight fly_undelayed(const config::Scenario& scenario, ErrorHistory& errors) {
  DelayedFlight result = fly(scenario, 0, [&](const model::StepRecord& step, double error) {
    errors.add(step, error);
    return std::string();
  });
  if (result.is_lost())
    throw std::runtime_error("the load is lost without any added delay: " + result.loss);
  return result;
}

DelayedFlight fly_delayed(const config::Scenario& scenario, std::int64_t periods,
                          const ErrorHistory& undelayed) {
  const double rod_length = config::make_vehicle_scenario(scenario, 0).vehicle.rod_length;
  return fly(scenario, periods, [&](const model::StepRecord& step, double error) {
    return is_load_lost(step, error, undelayed, rod_length)
               ? describe_loss(rod_length, "without delay")
               : std::string();
  });
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
                              const std::function<void(const DelayedFlight&)>& after_flight) {
  DelayMargin margin;
  margin.period_ns = scenario.sync.period_ns;
  margin.own_ns = calc_own_delay(scenario);
  const auto add = [&](const DelayedFlight& flight) {
    margin.flights.push_back(flight);
    if (after_flight) after_flight(flight);
    return flight.is_lost();
  };
  ErrorHistory undelayed;
  add(fly_undelayed(scenario, undelayed));
  const auto is_lost_with = [&](std::int64_t periods) {
    return add(fly_delayed(scenario, periods, undelayed));
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
