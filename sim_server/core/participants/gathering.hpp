#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/sync/patience.hpp"
#include "sim_server/core/participants/roster.hpp"

namespace sls::sim {

/// Before step 0: the wait for the participants that the scenario expects. Rules:
/// docs/synchronisation.md, "Waiting for participants".
class Gathering {
 public:
  Gathering(const config::WaitFor& expected, std::string scenario_sha256,
            std::vector<std::uint32_t> vehicle_ids, sync::Time now);

  enum class Finding { kReady, kMissing, kGivenUp };
  Finding look(const Roster& roster, sync::Time now);

  /// The participants that were missing at the last look.
  const std::string& missing() const { return missing_; }
  /// Why it was given up.
  std::string describe_error() const;

  struct Report {
    std::string text;
    std::string hint;      ///< to be appended: what a user can do
    bool is_news = false;  ///< others are missing than at the last report
  };
  std::optional<Report> take_report(sync::Time now);

 private:
  const config::WaitFor expected_;
  const std::string scenario_sha256_;
  const std::vector<std::uint32_t> vehicle_ids_;
  const sync::Time began_;
  sync::Patience patience_;
  std::string missing_;
  std::string reported_;
};

}  // namespace sls::sim
