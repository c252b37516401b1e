#include "closed_loop/measured_flight.hpp"

#include <algorithm>
#include <optional>

#include "closed_loop/flight_certificate.hpp"
#include "common/config/numbers.hpp"

namespace sls::closed_loop {
namespace {

constexpr std::uint64_t kStepsPerPoll = 64;

void check_vehicles(const config::Scenario& scenario) {
  if (scenario.vehicles.size() != 1)
    throw config::ConfigError("vehicles: expected one vehicle, of which a campaign measures, got " +
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
                            const ErrorHistory& base, bool certify, const FlightOptions& options,
                            const Poll& poll) {
  check_vehicles(scenario);
  const std::int64_t period_ns = scenario.sync.period_ns;
  const model::SlungLoadParameters vehicle = config::make_vehicle_scenario(scenario, 0).vehicle;
  const double rod_length = vehicle.rod_length;
  Flight flight(scenario, {0}, options);
  FlightMeasures measured(measures, period_ns, vehicle, flight.plant().has_attitude());
  std::optional<FlightCertificate> certificate;
  if (certify)
    certificate.emplace(record::RowFormat{period_ns, flight.plant().has_attitude(),
                                          static_cast<int>(flight.plant().signals().size())});
  MeasuredFlight result;
  std::optional<std::int64_t> loss_ns;
  while (const model::StepRecord* step = flight.fly_step()) {
    ++result.steps;
    if (certificate) certificate->add(*step);
    if (!loss_ns) {
      measured.add(*step);
      if (is_load_lost(*step, calc_load_error(*step), base, rod_length)) {
        loss_ns = calc_last_time_ns(result.steps, period_ns);
        result.outcome = Outcome::kLost;
        result.reason = describe_loss(rod_length, "in the base flight") + describe_time(*loss_ns);
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
  result.values =
      measured.finish(loss_ns ? std::optional(config::to_seconds(*loss_ns)) : std::nullopt);
  if (certificate) result.certificate = certificate->finish();
  return result;
}

void check_flight(const config::Scenario& scenario) {
  check_vehicles(scenario);
  const Flight flight(scenario);
}

ErrorHistory fly_base(const config::Scenario& base, const Poll& poll) {
  check_vehicles(base);
  ErrorHistory errors;
  Flight flight(base);
  std::uint64_t steps = 0;
  while (const model::StepRecord* step = flight.fly_step()) {
    errors.add(*step, calc_load_error(*step));
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
