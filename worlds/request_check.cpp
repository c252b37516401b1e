#include "worlds/request_check.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace sls::worlds {
namespace {

constexpr std::size_t kKept = 64;  // replies, for requests that come again
constexpr const char* kEnded = "the run has ended: ";

std::string name_operator(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](unsigned char letter) { return letter < 32 || letter == 127; },
      '?');
  return name.empty() ? "an operator without a name" : name;
}

}  // namespace

void RequestCheck::on_request(const SimControl& request, bool is_of_other) {
  const Key key{request.operator_name().to_string(), request.request_id()};
  const auto& ids = vehicle_ids_;
  if (request.run_id() != run_id_) {
    if (!is_of_other) replies_.push_back({key, false, "run: expected ", step_, 0});
    return;
  }
  if (std::find(ids.begin(), ids.end(), request.vehicle_id()) == ids.end())
    return replies_.push_back({key, false, "vehicle: expected ", step_, 0});
  const auto before = std::find_if(answered_.begin(), answered_.end(),
                                   [&](const Expected& reply) { return reply.key == key; });
  if (before != answered_.end()) return replies_.push_back(*before);
  if (stepping_ && stepping_->key == key) return;
  const std::string refusal = judge(request);
  if (!refusal.empty()) return expect({key, false, refusal, step_, 0});
  if (request.action() != ControlAction::ACTION_STEP) expect({key, true, "", step_, 0});
  act(request, key);
}

/// The begin of the reason why it is refused; empty if it is accepted.
std::string RequestCheck::judge(const SimControl& request) const {
  if (is_over_) return kEnded;
  const std::string busy = stepping_ ? "a step request is being carried out: " : "";
  switch (request.action()) {
    case ControlAction::ACTION_PAUSE:
      if (stepping_) return stepping_->paused_by.empty() ? "" : "already paused";
      return is_paused_ ? "already paused" : "";
    case ControlAction::ACTION_STEP:
      if (is_paused_ && request.steps() == 0) return "steps: expected at least 1, got 0";
      return is_paused_ ? busy : "not paused";
    case ControlAction::ACTION_START:
    case ControlAction::ACTION_RESUME:
      return is_paused_ ? busy : "not paused";
    case ControlAction::ACTION_RESET:
    case ControlAction::ACTION_STOP:
      return "";
  }
  return "action: expected one of 0 to 5, got ";
}

void RequestCheck::act(const SimControl& request, const Key& key) {
  switch (request.action()) {
    case ControlAction::ACTION_PAUSE:
      is_paused_ = true;
      if (stepping_) stepping_->paused_by = name_operator(key.operator_name);
      break;
    case ControlAction::ACTION_STEP:
      stepping_ = StepRequest{key, step_, request.steps(), ""};
      break;
    case ControlAction::ACTION_START:
    case ControlAction::ACTION_RESUME:
      is_paused_ = false;
      break;
    default:
      is_over_ = true;
      if (stepping_) expect_cut_short();
  }
}

void RequestCheck::expect(Expected reply) {
  if (answered_.size() == kKept) answered_.pop_front();
  answered_.push_back(reply);
  replies_.push_back(std::move(reply));
}

/// The reply to the open request for steps, as the run ends.
void RequestCheck::expect_cut_short() {
  const StepRequest& asked = *stepping_;
  const std::uint64_t done = step_ - asked.begin;
  expect({asked.key, false, fmt::format("{} of {} steps done: ", done, asked.steps), step_, done});
  stepping_.reset();
}

void RequestCheck::on_published(std::uint64_t step) {
  if (is_over_)
    find_(fmt::format("operator: step {} leaves after the end that an operator was told", step));
  else if (is_paused_ && !stepping_)
    find_(fmt::format("operator: step {} leaves in a pause", step));
}

void RequestCheck::on_recorded(std::uint64_t step) {
  step_ = step + 1;
  if (!stepping_ || is_over_) return;
  const StepRequest& asked = *stepping_;
  const std::uint64_t done = step_ - asked.begin;
  if (done == asked.steps)
    expect({asked.key, true, "", step_, done});
  else if (!asked.paused_by.empty())
    expect({asked.key, false,
            fmt::format("paused by {}: {} of {} steps done", asked.paused_by, done, asked.steps),
            step_, done});
  else
    return;
  stepping_.reset();
}

void RequestCheck::on_reply(const SimControlReply& reply) {
  // The end of the run came before the request for steps.
  if (stepping_ && reply.request_id() == stepping_->key.request_id &&
      reply.reason().to_string().rfind(kEnded, 0) == 0) {
    is_over_ = true;
    return stepping_.reset();
  }
  if (!replies_.empty()) {
    check(reply, replies_.front());
    return replies_.pop_front();
  }
  if (!stepping_ ||
      !is_cut_short(reply, stepping_->key, stepping_->begin, step_ - stepping_->begin))
    return find_(fmt::format("operator: request {} is answered without need: '{}'",
                             reply.request_id(), reply.reason().c_str()));
  stepping_.reset();
}

void RequestCheck::check(const SimControlReply& reply, const Expected& expected) {
  const std::string reason = reply.reason().to_string();
  // The last step of a run that ended before the reply need not count.
  const bool is_there =
      reply.step() == expected.step || (!expected.is_accepted && reply.step() + 1 == expected.step);
  const bool is_right = reply.accepted() == expected.is_accepted &&
                        reason.rfind(expected.reason, 0) == 0 &&
                        reason.empty() == expected.is_accepted && is_there;
  const bool is_ours = reply.request_id() == expected.key.request_id && reply.run_id() == run_id_ &&
                       std::count(vehicle_ids_.begin(), vehicle_ids_.end(), reply.vehicle_id()) > 0;
  if (is_ours && is_right) return;
  // The run may have ended meanwhile, in the last of the steps, too.
  if (is_ours && reason.rfind(kEnded, 0) == 0) return void(is_over_ = true);
  if (is_ours && expected.done > 0 &&
      is_cut_short(reply, expected.key, expected.step - expected.done, expected.done))
    return;
  find_(
      fmt::format("operator: expected the reply to request {} ({}, step {}, '{}'), got that to "
                  "{} ({}, step {}, '{}')",
                  expected.key.request_id, expected.is_accepted, expected.step, expected.reason,
                  reply.request_id(), reply.accepted(), reply.step(), reason));
}

/// The run has ended while `done` steps or one less were flown for `key`.
bool RequestCheck::is_cut_short(const SimControlReply& reply, const Key& key, std::uint64_t begin,
                                std::uint64_t done) {
  const std::string reason = reply.reason().to_string();
  for (const std::uint64_t flown : {done, done - std::min<std::uint64_t>(done, 1)}) {
    const bool is_it = reply.request_id() == key.request_id && !reply.accepted() &&
                       (reply.step() == begin + flown || reply.step() == begin + done) &&
                       reason.rfind(fmt::format("{} of ", flown), 0) == 0;
    if (is_it) return is_over_ = true;
  }
  return false;
}

void RequestCheck::on_end() {
  if (!replies_.empty() || stepping_)
    find_(fmt::format("operator: request {} is never answered",
                      (replies_.empty() ? stepping_->key : replies_.front().key).request_id));
}

}  // namespace sls::worlds
