#include "sim_server/core/run_control.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

#include "common/bus/names.hpp"
#include "common/config/vehicle_ids.hpp"
#include "common/sync/invariant.hpp"

namespace sls::sim {
namespace {

/// Name of the operator that sent `request`, fit for one line of a log.
std::string name_operator(const SimControl& request) {
  std::string name = request.operator_name().to_string();
  std::replace_if(
      name.begin(), name.end(), [](unsigned char letter) { return letter < ' ' || letter == 0x7f; },
      '?');
  if (name.empty()) name = "an operator without a name";
  return name;
}

std::string describe_progress(std::uint64_t done, std::uint64_t steps) {
  return fmt::format("{} of {} steps done", done, steps);
}

}  // namespace

RunControl::RunControl(std::uint64_t run_id, const std::vector<std::uint32_t>& vehicle_ids,
                       bool is_paused)
    : run_id_(run_id), vehicle_ids_(vehicle_ids), is_paused_(is_paused) {}

std::optional<SimControlReply> RunControl::request(const SimControl& request, std::uint64_t step) {
  // Requests for another run or vehicle do not change this run.
  if (request.run_id() != run_id_)
    return make_reply(request.request_id(), step,
                      fmt::format("run: expected {:016x}, got {:016x}", run_id_, request.run_id()));
  if (std::find(vehicle_ids_.begin(), vehicle_ids_.end(), request.vehicle_id()) ==
      vehicle_ids_.end())
    return make_reply(request.request_id(), step,
                      fmt::format("vehicle: expected {}, got {}",
                                  config::to_vehicle_ranges(vehicle_ids_), request.vehicle_id()));

  const std::string operator_name = request.operator_name().to_string();
  const auto earlier =
      std::find_if(answered_.begin(), answered_.end(), [&](const Answered& answered) {
        return answered.operator_name == operator_name &&
               answered.reply.request_id() == request.request_id();
      });
  if (earlier != answered_.end()) return earlier->reply;
  if (stepping_ && stepping_->operator_name == operator_name &&
      stepping_->request_id == request.request_id())
    return std::nullopt;  // its reply is still to come

  const std::string refusal = find_refusal(request);
  if (refusal.empty()) act(request);
  if (refusal.empty() && request.action() == ControlAction::ACTION_STEP) return std::nullopt;
  return remember(operator_name, make_reply(request.request_id(), step, refusal));
}

std::string RunControl::find_refusal(const SimControl& request) const {
  if (end_reason_) return "the run has ended: " + *end_reason_;
  if (is_stop_requested_ && request.action() != ControlAction::ACTION_STOP)
    return "the run is about to end: " + last_event_;
  if (is_reset_requested_ && request.action() != ControlAction::ACTION_STOP &&
      request.action() != ControlAction::ACTION_RESET)
    return "the run is about to end: " + last_event_;
  std::string busy;
  if (stepping_)
    busy = "a step request is being carried out: " +
           describe_progress(stepping_->done, stepping_->steps);
  switch (request.action()) {
    case ControlAction::ACTION_START:
    case ControlAction::ACTION_RESUME:
      if (!is_paused_) return "not paused";
      return busy;
    case ControlAction::ACTION_PAUSE:
      if (stepping_) return stepping_->cut_short_by.empty() ? "" : "already paused";
      return is_paused_ ? "already paused" : "";
    case ControlAction::ACTION_STEP:
      if (!is_paused_) return "not paused";
      if (request.steps() < 1) return "steps: expected at least 1, got 0";
      return busy;
    case ControlAction::ACTION_RESET:
    case ControlAction::ACTION_STOP:
      return "";
  }
  return fmt::format("action: expected one of {} to {}, got {}",
                     bus::to_number(ControlAction::ACTION_START),
                     bus::to_number(ControlAction::ACTION_STOP), bus::to_number(request.action()));
}

RunControl::StepRequest RunControl::make_step_request(const SimControl& request) {
  StepRequest accepted;
  accepted.operator_name = request.operator_name().to_string();
  accepted.request_id = request.request_id();
  accepted.steps = request.steps();
  return accepted;
}

void RunControl::act(const SimControl& request) {
  ++events_;
  const std::string who = name_operator(request);
  switch (request.action()) {
    case ControlAction::ACTION_START:
      is_paused_ = false;
      last_event_ = "started by " + who;
      break;
    case ControlAction::ACTION_RESUME:
      is_paused_ = false;
      last_event_ = "resumed by " + who;
      break;
    case ControlAction::ACTION_PAUSE:
      is_paused_ = true;
      if (stepping_) stepping_->cut_short_by = who;
      last_event_ = "paused by " + who;
      break;
    case ControlAction::ACTION_STEP:
      stepping_ = make_step_request(request);
      last_event_ = fmt::format("{} steps requested by {}", request.steps(), who);
      break;
    case ControlAction::ACTION_RESET:
      is_reset_requested_ = true;
      last_event_ = "reset by " + who;
      break;
    case ControlAction::ACTION_STOP:
      is_stop_requested_ = true;
      last_event_ = "stopped by " + who;
      break;
  }
}

bool RunControl::holds() const {
  if (end_reason_ || is_stop_requested_ || is_reset_requested_) return true;
  // A pause during a step request takes effect after the step in work or, between steps, after the
  // next one: the end of a step sends the reply.
  return is_paused_ && !stepping_;
}

std::optional<SimControlReply> RunControl::stepped(std::uint64_t step) {
  if (!stepping_) return std::nullopt;
  ++stepping_->done;
  sync::keep(stepping_->done <= stepping_->steps, "a request of N steps flies N");
  if (stepping_->done >= stepping_->steps) return close_step_request(step, "");
  if (stepping_->cut_short_by.empty()) return std::nullopt;
  return close_step_request(step,
                            fmt::format("paused by {}: {}", stepping_->cut_short_by,
                                        describe_progress(stepping_->done, stepping_->steps)));
}

std::optional<SimControlReply> RunControl::end(std::uint64_t step, const std::string& reason) {
  if (!end_reason_) end_reason_ = reason;
  if (!stepping_) return std::nullopt;
  return close_step_request(step,
                            describe_progress(stepping_->done, stepping_->steps) + ": " + reason);
}

SimControlReply RunControl::close_step_request(std::uint64_t step, const std::string& refusal) {
  const StepRequest closed = *std::exchange(stepping_, std::nullopt);
  return remember(closed.operator_name, make_reply(closed.request_id, step, refusal));
}

SimControlReply RunControl::remember(const std::string& operator_name, SimControlReply reply) {
  if (answered_.size() == kRememberedReplies) answered_.pop_front();
  return answered_.emplace_back(Answered{operator_name, std::move(reply)}).reply;
}

SimControlReply RunControl::make_reply(std::uint64_t request_id, std::uint64_t step,
                                       const std::string& refusal) const {
  SimControlReply reply;
  reply.run_id(run_id_);
  reply.vehicle_id(vehicle_ids_.front());
  reply.request_id(request_id);
  reply.accepted(refusal.empty());
  reply.reason(refusal);
  reply.step(step);
  return reply;
}

}  // namespace sls::sim
