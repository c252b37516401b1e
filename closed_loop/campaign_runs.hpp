/// The runs of a campaign, one after the other: a base scenario with some of its values replaced.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "closed_loop/measured_flight.hpp"
#include "common/config/scenario_draft.hpp"

namespace sls::closed_loop {

class CampaignRuns {
 public:
  /// Reads and flies the scenario `base`. `paths` are the keys that vary, `measures` the names of
  /// MeasureList; `period_s` is the control period of all runs, default: the scenario's.
  /// @throws config::ConfigError naming the file where `base` cannot be read or fails.
  CampaignRuns(std::filesystem::path base, std::vector<std::string> paths,
               std::vector<std::string> measures, std::optional<double> period_s = {},
               const Poll& poll = {});

  const std::vector<std::string>& columns() const { return measures_.columns(); }

  /// The scenario with these YAML values, one for each path. Its `text`, saved as a file in the
  /// folder of `base`, gives the same scenario.
  /// @throws config::ConfigError as reading that file does; line numbers are those of `base`.
  config::Scenario make_scenario(const std::vector<std::string>& values) const;

  /// @throws config::ConfigError as make_scenario and fly_measured do.
  MeasuredFlight fly(const std::vector<std::string>& values, bool certify,
                     const Poll& poll = {}) const;

  /// Checks the values without a flight.
  /// @throws config::ConfigError if `fly` would.
  void check(const std::vector<std::string>& values) const;

 private:
  const std::filesystem::path file_;
  const std::vector<std::string> paths_;
  config::ScenarioDraft draft_;  // with the period in force
  config::Scenario base_;
  MeasureList measures_;
  FlightErrors errors_;
};

}  // namespace sls::closed_loop
