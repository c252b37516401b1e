#include "closed_loop/campaign_runs.hpp"

#include <utility>

#include "common/config/numbers.hpp"

namespace sls::closed_loop {
namespace {

/// The scenario of `draft`, after `period_s` is set in both. As with --period-s, the step of the
/// plant then becomes at most as long as the period.
config::Scenario put_in_force(std::optional<double> period_s, config::ScenarioDraft& draft) {
  config::Scenario scenario = draft.make_scenario();
  if (!period_s) return scenario;
  config::override_period(scenario, *period_s);
  draft.set("sync.period_s", config::to_text(*period_s));
  draft.set("plant.step_s", config::to_text(config::to_seconds(scenario.plant.step_ns)));
  return draft.make_scenario();
}

/// Calls `work` and adds the name of the file to a ConfigError without it.
template <class Work>
auto name_file(const std::filesystem::path& file, const Work& work) {
  try {
    return work();
  } catch (const config::ConfigError& error) {
    const std::string message = error.what();
    if (message.rfind(file.string() + ":", 0) == 0) throw;
    throw config::ConfigError(file.string() + ": " + message);
  }
}

}  // namespace

CampaignRuns::CampaignRuns(std::filesystem::path base, std::vector<std::string> paths,
                           std::vector<std::string> measures, std::optional<double> period_s,
                           const Poll& poll)
    : file_(std::move(base)),
      paths_(std::move(paths)),
      draft_(file_),
      base_(name_file(file_, [&] { return put_in_force(period_s, draft_); })),
      measures_(base_, std::move(measures)),
      errors_(name_file(file_, [&] { return fly_base(base_, poll); })) {}

config::Scenario CampaignRuns::make_scenario(const std::vector<std::string>& values) const {
  if (values.size() != paths_.size())
    throw config::ConfigError("expected " + std::to_string(paths_.size()) +
                              " values, one for each path, got " + std::to_string(values.size()));
  return name_file(file_, [&] {
    config::ScenarioDraft draft = draft_;
    for (std::size_t i = 0; i < paths_.size(); ++i) draft.set(paths_[i], values[i]);
    return draft.make_scenario();
  });
}

MeasuredFlight CampaignRuns::fly(const std::vector<std::string>& values, bool certify,
                                 const Poll& poll) const {
  const config::Scenario scenario = make_scenario(values);
  return name_file(file_,
                   [&] { return fly_measured(scenario, measures_, errors_, certify, {}, poll); });
}

void CampaignRuns::check(const std::vector<std::string>& values) const {
  const config::Scenario scenario = make_scenario(values);
  name_file(file_, [&] { check_flight(scenario, errors_); });
}

}  // namespace sls::closed_loop
