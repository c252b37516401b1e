#include "control_client/core/client_core.hpp"

#include <spdlog/fmt/fmt.h>

#include "common/config/vehicle_ids.hpp"

namespace sls::control {
namespace {

// Between two looks.
constexpr sync::Duration kFindingTime = std::chrono::milliseconds(5);
constexpr sync::Duration kFlyingTime = std::chrono::milliseconds(20);

}  // namespace

ClientCore::Act ClientCore::look(const sync::Servers& servers, const Now& now) {
  const Act act = decide(servers, now);
  // A flight can be shorter than the time between two looks while it is flown.
  deadline_ = now.time + (act == Act::kBegin          ? sync::Duration()
                          : phase_ == Phase::kFinding ? kFindingTime
                                                      : kFlyingTime);
  return act;
}

ClientCore::Act ClientCore::decide(const sync::Servers& servers, const Now& now) {
  if (phase_ == Phase::kEnded) return Act::kNone;
  if (now.is_stopped) return end(run_ ? Act::kLeave : Act::kGiveUp);
  return phase_ == Phase::kFinding ? find(servers, now) : fly(servers, now);
}

std::vector<std::uint32_t> ClientCore::list_flown_ids() const {
  std::vector<std::uint32_t> ids;
  for (const std::uint32_t id : options_.vehicle_ids)
    if (run_ && sync::serves_vehicle(run_->parameters, id)) ids.push_back(id);
  return ids;
}

Participant ClientCore::make_announcement() const {
  Participant message = options_.identity;
  message.role(ParticipantRole::ROLE_CONTROLLER);
  message.last_complete_step(-1);
  // Without a run, too: each writer of sls/command announces itself.
  message.vehicle_ids(run_ ? list_flown_ids() : options_.vehicle_ids);
  if (!run_) return message;
  message.run_id(run_->parameters.run_id());
  message.ready(is_ready_ && phase_ != Phase::kEnded);
  message.done(phase_ == Phase::kEnded);
  return message;
}

ClientCore::Act ClientCore::find(const sync::Servers& servers, const Now& now) {
  for (const std::uint32_t id : options_.vehicle_ids)
    if (const auto run = servers.find_joinable(id, now.time)) return begin(*run, now.time);
  if (!patience_) patience_.emplace(now.time, options_.join_timeout_s, sync::kUsualJoinTime);
  const std::string vehicles = config::to_vehicle_ranges(options_.vehicle_ids);
  if (patience_->is_over(now.time))
    return end(Act::kGiveUp, fmt::format("no server for vehicle {} within {} s", vehicles,
                                         options_.join_timeout_s));
  if (patience_->is_report_due(now.time))
    lines_.push_back({false, fmt::format("waiting for: server of vehicle {} ({:.0f} s left)",
                                         vehicles, patience_->seconds_left(now.time))});
  return Act::kNone;
}

ClientCore::Act ClientCore::begin(const sync::Run& run, sync::Time now) {
  phase_ = Phase::kFlying;
  run_ = run;
  is_ready_ = false;
  watch_.emplace(run.parameters.run_id(), options_.server_deadline_s, now);
  return Act::kBegin;
}

ClientCore::Act ClientCore::fly(const sync::Servers& servers, const Now& now) {
  const std::uint64_t run_id = run_->parameters.run_id();
  const auto status = servers.find_status(run_id);
  if (status && status->phase() == RunPhase::PHASE_FINISHED) return end(Act::kLeave);
  if (status && status->phase() == RunPhase::PHASE_FAILED)
    return end(Act::kLeave, fmt::format("the run failed: {}", status->reason().c_str()));

  const auto finding = watch_->look(servers.find_last_heard(run_id), now.time);
  if (watch_->report()) lines_.push_back(*watch_->report());
  if (const auto next = servers.find_successor(*run_, list_flown_ids(), now.time))
    return follow(*next, now.time);
  if (finding == sync::ServerWatch::Finding::kLost)
    return end(Act::kGiveUp,
               fmt::format("the {}, expected it to finish", watch_->describe(now.time)));
  if (is_ready_ || !now.sees_server) return Act::kNone;
  is_ready_ = true;
  return Act::kAnnounceReady;
}

ClientCore::Act ClientCore::follow(const sync::Run& next, sync::Time now) {
  const bool is_reset = next.server == run_->server;
  std::string news = fmt::format("run {:016x} was {} run {:016x}", run_->parameters.run_id(),
                                 is_reset ? "reset to" : "replaced by", next.parameters.run_id());
  if (!is_reset && !options_.follows_servers) return end(Act::kGiveUp, news + " (see --follow)");
  lines_.push_back({true, std::move(news) + ": following it"});
  return begin(next, now);
}

ClientCore::Act ClientCore::end(Act act, std::string error) {
  phase_ = Phase::kEnded;
  error_ = std::move(error);
  return act;
}

}  // namespace sls::control
