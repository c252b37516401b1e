#include "closed_loop/measured_flight.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "closed_loop/flight_certificate.hpp"
#include "common/config/numbers.hpp"

namespace sls::closed_loop {
namespace {

constexpr std::uint64_t kStepsPerPoll = 64;

void check_vehicles(const config::Scenario& scenario, const FlightErrors& base) {
  if (scenario.vehicles.size() != base.size())
    throw config::ConfigError("vehicles: expected " + std::to_string(base.size()) +
                              ", as in the base scenario, got " +
                              std::to_string(scenario.vehicles.size()));
}

}  // namespace

const char* to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::kFinished:
      return "finished";
    case Outcome::kLost:
      return "lost";
    case Outcome::kFailed:
      return "failed";
  }
  return "failed";
}

MeasuredFlight fly_measured(const config::Scenario& scenario, const MeasureList& measures,
                            const FlightErrors& base, bool certify, const FlightOptions& options,
                            const Poll& poll) {
  check_vehicles(scenario, base);
  const std::int64_t period_ns = scenario.sync.period_ns;
  const std::vector<std::uint32_t> ids = list_vehicles(scenario);
  Flight flight(scenario, ids, options);
  std::vector<FlightMeasures> measured;
  for (const std::uint32_t id : ids)
    measured.emplace_back(measures, period_ns, config::make_vehicle_scenario(scenario, id).vehicle,
                          flight.plant().has_attitude());
  const LossRule rule(scenario, base, "in the base flight");
  std::optional<FlightCertificate> certificate;
  if (certify)
    certificate.emplace(record::RowFormat{period_ns, flight.plant().has_attitude(),
                                          static_cast<int>(flight.plant().signals().size())});
  MeasuredFlight result;
  std::optional<std::int64_t> loss_ns;
  while (flight.fly_step()) {
    const std::vector<model::StepRecord>& steps = flight.steps();
    ++result.steps;
    if (certificate)
      for (const model::StepRecord& step : steps) certificate->add(step);
    if (!loss_ns) {
      for (std::size_t i = 0; i < steps.size(); ++i) measured[i].add(steps[i]);
      result.reason = rule.judge(steps);
      if (!result.reason.empty()) {
        loss_ns = calc_last_time_ns(result.steps, period_ns);
        result.outcome = Outcome::kLost;
        result.reason += describe_time(*loss_ns);
        if (!certify) break;
      }
    }
    if (poll && result.steps % kStepsPerPoll == 0) poll();
  }
  if (!loss_ns && !flight.failure().empty()) {
    loss_ns = std::max<std::int64_t>(calc_last_time_ns(result.steps, period_ns), 0);
    result.outcome = Outcome::kFailed;
    result.reason = flight.failure() + describe_time(*loss_ns);
    std::replace(result.reason.begin(), result.reason.end(), '\n', ' ');
  }
  const auto loss_s = loss_ns ? std::optional(config::to_seconds(*loss_ns)) : std::nullopt;
  result.values = measured.front().finish(loss_s);
  for (std::size_t i = 1; i < measured.size(); ++i) {
    const std::vector<double> values = measured[i].finish(loss_s);
    for (std::size_t k = 0; k < values.size(); ++k)
      if (std::isnan(result.values[k]) || values[k] > result.values[k])
        result.values[k] = values[k];
  }
  if (certificate) result.certificate = certificate->finish();
  return result;
}

void check_flight(const config::Scenario& scenario, const FlightErrors& base) {
  check_vehicles(scenario, base);
  const Flight flight(scenario, list_vehicles(scenario));
}

FlightErrors fly_base(const config::Scenario& base, const Poll& poll) {
  FlightErrors errors;
  Flight flight(base, list_vehicles(base));
  std::uint64_t steps = 0;
  while (flight.fly_step()) {
    add_errors(flight.steps(), errors);
    if (++steps % kStepsPerPoll == 0 && poll) poll();
  }
  if (!flight.failure().empty())
    throw config::ConfigError(
        "the base scenario fails, and by its flight the others would be judged: " +
        flight.failure() +
        describe_time(std::max<std::int64_t>(calc_last_time_ns(steps, base.sync.period_ns), 0)));
  return errors;
}

}  // namespace sls::closed_loop
