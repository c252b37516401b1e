#include "sim_server/core/participants/preparation.hpp"

#include <stdexcept>

#include "sim_server/core/participants/claim.hpp"

namespace sls::sim {

void Preparation::claim(const Surroundings& around, sync::Time now) {
  // Of two servers the one that looks later finds the port of the other open and waits for its
  // claim, however slow discovery is.
  const bool is_settled = is_claim_settled(now - began_, around.stays_on_this_machine(),
                                           around.has_heard_every_claim());
  if (!is_settled) return;
  // Not earlier: the history of another server arrives sample by sample, and its run may have
  // ended.
  check_claim(around);
  start_gathering(now);
}

void Preparation::check_claim(const Surroundings& around) const {
  const int progress = run_.report.has_published() ? sync::calc_progress(run_.report.phase()) : 0;
  const std::string rival =
      describe_rival(around.find_other_runs(), run_.run_id, run_.fleet.ids(), progress);
  if (!rival.empty()) throw std::runtime_error(rival + around.describe_other_flight());
}

void Preparation::start_gathering(sync::Time now) {
  gathering_.emplace(run_.scenario.sync.wait_for, run_.scenario.sha256, run_.fleet.ids(), now);
  run_.report.publish(RunPhase::PHASE_WAITING, "participants are not ready", now);
  run_.announce_remarks(now);
}

bool Preparation::gather(const Surroundings& around, sync::Time now) {
  const auto finding = gathering_->look(run_.watch.roster(), now);
  if (finding == Gathering::Finding::kReady) return true;
  const auto describe_obstacles = [&] {
    return run_.report.describe_problem() + around.describe_isolation();
  };
  if (finding == Gathering::Finding::kGivenUp)
    throw std::runtime_error(gathering_->describe_error() + describe_obstacles());
  const auto report = gathering_->take_report(now);
  if (!report) return false;
  const std::string obstacles = describe_obstacles();
  run_.outputs.log({false, report->text + (obstacles.empty() ? report->hint : obstacles)});
  if (report->is_news)
    run_.report.publish(RunPhase::PHASE_WAITING, "missing: " + gathering_->missing(), now);
  return false;
}

}  // namespace sls::sim
