/// Effect of an operator's requests on a run: pause, step, resume, reset, stop, with the semantics
/// of the ROS simulation interfaces. The loop calls it before every step. No network, no clock
/// here.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "sls.h"

namespace sls::sim {

/// Rules of acceptance: docs/synchronisation.md, "Operator control".
class RunControl {
 public:
  /// Controls run `run_id`, which begins unpaused unless `is_paused`.
  /// A request names any of its vehicles.
  RunControl(std::uint64_t run_id, const std::vector<std::uint32_t>& vehicle_ids, bool is_paused);

  /// Judges `request`, made while the loop is at `step` (published next, or awaiting its answer).
  /// Returns the reply. That of an accepted step request comes later, from `stepped` or `end`. A
  /// repeated request (same operator, same request_id) is answered again and acts once.
  std::optional<SimControlReply> request(const SimControl& request, std::uint64_t step);

  /// True when the loop must not begin the next step.
  bool holds() const;

  /// True if the run is paused or about to pause, as in sls/status. A run that carries out a step
  /// request counts as paused: its successor after a reset begins paused, too.
  bool is_paused() const { return is_paused_; }

  /// Call when a step was completed and the loop is now at `step`. Returns the reply to a step
  /// request that is then complete, or that a pause ends here.
  std::optional<SimControlReply> stepped(std::uint64_t step);

  /// Returns the reply to a step request still open when the run ends at `step` (accepted: false,
  /// with `reason`). Later requests are refused.
  std::optional<SimControlReply> end(std::uint64_t step, const std::string& reason);

  bool is_reset_requested() const { return is_reset_requested_; }
  bool is_stop_requested() const { return is_stop_requested_; }

  /// The last accepted request, for events and reasons: "paused by anna@host"; empty before.
  const std::string& last_event() const { return last_event_; }

  /// Number of accepted requests so far.
  std::uint64_t events() const { return events_; }

  /// Number of replies that are kept for repeated requests.
  static constexpr std::size_t kRememberedReplies = 64;

 private:
  struct Answered {
    std::string operator_name;
    SimControlReply reply;
  };
  struct StepRequest {
    std::string operator_name;
    std::uint64_t request_id = 0;
    std::uint64_t steps = 0;
    std::uint64_t done = 0;
    std::string cut_short_by;  ///< operator who paused during it: the run ends its step and pauses
  };

  /// Why `request` is refused in the present state; empty if it is accepted.
  std::string find_refusal(const SimControl& request) const;
  void act(const SimControl& request);
  static StepRequest make_step_request(const SimControl& request);
  SimControlReply make_reply(std::uint64_t request_id, std::uint64_t step,
                             const std::string& refusal) const;
  SimControlReply remember(const std::string& operator_name, SimControlReply reply);
  SimControlReply close_step_request(std::uint64_t step, const std::string& refusal);

  const std::uint64_t run_id_;
  const std::vector<std::uint32_t> vehicle_ids_;
  bool is_paused_;
  bool is_reset_requested_ = false;
  bool is_stop_requested_ = false;
  std::optional<std::string> end_reason_;
  std::optional<StepRequest> stepping_;
  std::deque<Answered> answered_;  // the last kRememberedReplies
  std::string last_event_;
  std::uint64_t events_ = 0;
};

}  // namespace sls::sim
