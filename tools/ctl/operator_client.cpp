#include "tools/ctl/operator_client.hpp"

#include <pwd.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <random>
#include <thread>

#include "common/app/log.hpp"
#include "common/app/run_error.hpp"
#include "common/app/stop_signal.hpp"
#include "common/bus/names.hpp"

namespace sls::ctl {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kUsualWait = 1500ms;  // usual time of discovery and a server's claim: not reported
constexpr auto kLastReplyTime = 1s;  // a reply can arrive shortly after the run has ended
constexpr std::size_t kMailboxSize = 256;
constexpr std::size_t kEvents = 3;
constexpr std::size_t kRunsWithEvents = 64;  // more than the servers of a domain fly at a time

std::uint64_t make_request_id() {
  std::random_device random;  // replies name no operator: ids must differ between operators, too
  return (static_cast<std::uint64_t>(random()) << 32) | random();
}

}  // namespace

OperatorClient::Channel::Channel(bus::Node& node, app::Mailbox<Received>& replies)
    : reply_reader(node, bus::kLatchedReaderProfile,
                   [&replies](const SimControlReply& reply, const bus::PeerId& sender) {
                     replies.put({reply, sender});
                   }),
      request_writer(node) {}

OperatorClient::OperatorClient(bus::Node& node, const ClientOptions& options)
    : options_(options),
      participants_(node),
      servers_(node, [this](const SimStatus& status) { note_event(status); }),
      replies_(kMailboxSize) {
  if (options_.asks) channel_.emplace(node, replies_);
}

// --- finding a run -------------------------------------------------------------------------------

std::optional<sync::Run> OperatorClient::wait_for_run() const {
  return wait_for([this] { return servers_.find_joinable(options_.vehicle_id); });
}

std::optional<sync::Run> OperatorClient::wait_for_any_run() const {
  return wait_for([this] {
    const auto run = servers_.find_joinable(options_.vehicle_id);
    return run ? run : find_any_run(servers_, options_.vehicle_id);
  });
}

std::optional<sync::Run> OperatorClient::wait_for(const FindRun& find) const {
  app::Wait wait(options_.timeout_s, kUsualWait);
  while (app::stop_signal() == 0) {
    if (auto run = find()) return run;
    if (wait.is_over())
      throw app::RunError(fmt::format("no server for vehicle {} on domain {} within {} s",
                                      options_.vehicle_id, options_.domain, options_.timeout_s));
    if (wait.is_report_due())
      spdlog::info("waiting for: server of vehicle {} on domain {} ({:.0f} s left)",
                   options_.vehicle_id, options_.domain, wait.seconds_left());
    std::this_thread::sleep_for(app::kPollTime);
  }
  return std::nullopt;
}

sync::Run OperatorClient::refresh(const sync::Run& run) const {
  sync::Run last = run;
  if (const auto status = servers_.find_status(run.parameters.run_id())) last.status = status;
  if (has_ended(last.status)) return last;
  return servers_.find_joinable(options_.vehicle_id).value_or(last);
}

Snapshot OperatorClient::make_snapshot(const sync::Run& run) const {
  const std::uint64_t run_id = run.parameters.run_id();
  Snapshot snapshot;
  snapshot.parameters = run.parameters;
  snapshot.vehicle_id = options_.vehicle_id;
  snapshot.status = run.status;
  snapshot.server_is_gone = !servers_.is_present(run.server);
  if (const auto heard = servers_.find_last_heard(run_id))
    snapshot.silence_s = std::chrono::duration<double>(Clock::now() - *heard).count();
  {
    const std::lock_guard lock(events_mutex_);
    for (const Events& events : events_)
      if (events.run_id == run_id) snapshot.events.assign(events.lines.begin(), events.lines.end());
  }
  for (const auto role : {ParticipantRole::ROLE_CONTROLLER, ParticipantRole::ROLE_RECORDER})
    for (const auto& entry : participants_.find(role, run_id))
      snapshot.participants.push_back(entry.announcement);
  return snapshot;
}

OperatorClient::Events& OperatorClient::find_or_add_events(std::uint64_t run_id) {
  const auto known = std::find_if(events_.begin(), events_.end(), [run_id](const Events& events) {
    return events.run_id == run_id;
  });
  if (known != events_.end()) {
    events_.splice(events_.end(), events_, known);
    return events_.back();
  }
  if (events_.size() == kRunsWithEvents) events_.pop_front();
  return events_.emplace_back(Events{run_id, {}, {}});
}

void OperatorClient::note_event(const SimStatus& status) {
  const std::string reason = status.reason().to_string();
  const std::lock_guard lock(events_mutex_);
  Events& events = find_or_add_events(status.run_id());
  if (reason.empty() || reason == events.last_reason) return;
  events.last_reason = reason;
  events.lines.push_back(fmt::format("step {}: {}", status.step(), reason));
  if (events.lines.size() > kEvents) events.lines.pop_front();
}

// --- requests ------------------------------------------------------------------------------------

std::optional<SimControlReply> OperatorClient::ask(const sync::Run& run, ControlAction action,
                                                   std::uint64_t steps) {
  auto question = send(run, action, steps);
  while (question && app::stop_signal() == 0)
    if (auto reply = find_reply(*question, Clock::now() + app::kPollTime)) return reply;
  return std::nullopt;
}

std::optional<OperatorClient::Question> OperatorClient::send(const sync::Run& run,
                                                             ControlAction action,
                                                             std::uint64_t steps) {
  SimControl request;
  request.run_id(run.parameters.run_id());
  request.vehicle_id(options_.vehicle_id);
  request.request_id(make_request_id());
  request.operator_name(make_operator_name());
  request.action(action);
  request.steps(steps);

  app::Wait wait(options_.timeout_s, kUsualWait);
  if (!wait_until_heard(run, wait)) return std::nullopt;
  channel_->request_writer.write(request);
  return Question{run, request, wait,
                  sync::ServerWatch(run.parameters.run_id(), options_.timeout_s, Clock::now()),
                  std::nullopt};
}

std::optional<SimControlReply> OperatorClient::find_reply(Question& question,
                                                          Clock::time_point deadline) {
  const sync::Run& run = question.run;
  do {
    const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Received& received) {
      return received.sender == run.server &&
             received.reply.request_id() == question.request.request_id();
    });
    if (found == kept_.end()) continue;
    const SimControlReply reply = found->reply;
    kept_.erase(found);
    return reply;
  } while (keep_next_reply(deadline));

  const char* const action = to_string(question.request.action());
  const auto status = servers_.find_status(run.parameters.run_id());
  if (sync::calc_progress(status) < 0 && !question.give_up)
    question.give_up = Clock::now() + kLastReplyTime;
  if (question.give_up && Clock::now() >= *question.give_up)
    throw app::RunError(fmt::format("no reply to {}: the run has ended: {}, {}", action,
                                    bus::to_string(status->phase()), status->reason().c_str()));
  const auto now = Clock::now();
  const auto finding = question.server.look(servers_.find_last_heard(run.parameters.run_id()), now);
  if (question.server.report()) app::log(*question.server.report());
  if (finding == sync::ServerWatch::Finding::kLost)
    throw app::RunError(fmt::format("no reply to {}: {}", action, question.server.describe(now)));
  const bool takes_its_time = question.request.action() == ControlAction::ACTION_STEP;
  if (!takes_its_time && question.wait.is_over())
    throw app::RunError(fmt::format("no reply to {} from the server of run {:016x} within {} s",
                                    action, run.parameters.run_id(), options_.timeout_s));
  if (question.wait.is_report_due()) report_wait(run, question.request, question.wait);
  return std::nullopt;
}

bool OperatorClient::keep_next_reply(Clock::time_point deadline) {
  auto received = replies_.take(deadline);
  if (!received) return false;
  if (kept_.size() == kMailboxSize) kept_.pop_front();
  kept_.push_back(std::move(*received));
  return true;
}

bool OperatorClient::wait_until_heard(const sync::Run& run, app::Wait& wait) const {
  while (channel_->request_writer.matched().count(run.server) == 0 ||
         channel_->reply_reader.matched().count(run.server) == 0) {
    if (app::stop_signal() != 0) return false;
    if (wait.is_over())
      throw app::RunError(
          fmt::format("the server of run {:016x} takes no requests: expected it on sls/control and "
                      "sls/control_reply within {} s",
                      run.parameters.run_id(), options_.timeout_s));
    if (wait.is_report_due())
      spdlog::info("waiting for: server of run {:016x} to take requests ({:.0f} s left)",
                   run.parameters.run_id(), wait.seconds_left());
    std::this_thread::sleep_for(app::kPollTime);
  }
  return true;
}

void OperatorClient::report_wait(const sync::Run& run, const SimControl& request,
                                 const app::Wait& wait) const {
  if (request.action() != ControlAction::ACTION_STEP) {
    spdlog::info("waiting for: reply of the server ({:.0f} s left)", wait.seconds_left());
    return;
  }
  // The status before the request has the step at which the run was paused.
  const auto status = servers_.find_status(request.run_id());
  const std::uint64_t begin = run.status ? run.status->step() : 0;
  const std::uint64_t now = status ? std::max(status->step(), begin) : begin;
  spdlog::info("waiting for: {} steps ({} done, at step {})", request.steps(),
               std::min(now - begin, request.steps()), now);
}

std::optional<sync::Run> find_any_run(const bus::ServerDirectory& servers,
                                      std::uint32_t vehicle_id) {
  for (const sync::Run& run : servers.runs())
    if (run.status && sync::serves_vehicle(run.parameters, vehicle_id)) return run;
  return std::nullopt;
}

std::string make_operator_name() {
  const passwd* user = getpwuid(geteuid());
  const std::string name = user ? user->pw_name : std::to_string(geteuid());
  return (name + "@" + bus::host_name()).substr(0, 64);
}

const char* to_string(ControlAction action) {
  switch (action) {
    case ControlAction::ACTION_START:
      return "start";
    case ControlAction::ACTION_PAUSE:
      return "pause";
    case ControlAction::ACTION_STEP:
      return "step";
    case ControlAction::ACTION_RESUME:
      return "resume";
    case ControlAction::ACTION_RESET:
      return "reset";
    case ControlAction::ACTION_STOP:
      return "stop";
  }
  return "unknown";
}

}  // namespace sls::ctl
