/// The server: claims its vehicle, waits for its participants, flies the scenario in lockstep and
/// says how it ended. One thread works; the middleware's threads only fill mailboxes.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "common/app/mailbox.hpp"
#include "common/app/wait.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/command_gate.hpp"
#include "sim_server/messages.hpp"
#include "sim_server/retransmission_timer.hpp"
#include "sim_server/roster.hpp"

namespace sls::sim {

class Server {
 public:
  /// Joins the domain of `node` with the scenario in force.
  Server(bus::Node& node, const config::Scenario& scenario);

  /// Runs from the claim to the end. Returns when the recorders are done.
  /// @throws app::RunError saying why the run failed, after the participants have been told.
  void run();

 private:
  using Clock = std::chrono::steady_clock;
  struct Received {
    ControlCommand command;
    bus::PeerId sender;
  };

  void claim_vehicle();
  void wait_for_participants();
  void fly();
  void linger();

  /// What to do about an answer that has not come by the first resend.
  struct LateAnswer {
    LateAnswer(Clock::time_point sent, const config::Sync& sync)
        : take_over_time(std::chrono::duration_cast<Clock::duration>(
              std::chrono::duration<double>(sync.take_over_s))),
          take_over_at(sent + take_over_time),
          wait(sync.wait_for.timeout_s) {}
    Clock::duration take_over_time;
    Clock::time_point take_over_at;
    app::Wait wait;
  };

  /// Publishes `state` and returns the accepted answer to it.
  ControlCommand exchange(const VehicleState& state);
  void attend_to_late_answer(std::uint64_t step, LateAnswer& late);
  void judge(const Received& received);
  void wait_for_recorders(std::uint64_t step);
  /// Says now and then for whom `step` waits; throws when that has taken too long.
  void report_stall(std::uint64_t step, const std::string& waiting, app::Wait& wait);

  Roster find_roster() const;
  void refresh_clients();
  void check_claim() const;
  void check_stop() const;
  void publish_status(RunPhase phase, const std::string& reason);
  void publish_status_now_and_then();
  double calc_real_time_factor() const;

  const config::Scenario scenario_;
  const std::uint64_t run_id_;
  const std::uint32_t vehicle_id_ = 0;

  bus::ParticipantDirectory participants_;
  bus::ServerDirectory servers_;
  bus::Writer<VehicleState> state_writer_;
  bus::Writer<Parameters> parameters_writer_;
  bus::Writer<SimStatus> status_writer_;
  app::Mailbox<Received> commands_;
  bus::Reader<ControlCommand> command_reader_;

  CommandGate gate_;
  RetransmissionTimer timer_;
  Roster roster_;
  std::uint64_t roster_version_ = 0;
  Clock::time_point roster_time_;
  Clock::time_point status_time_;
  Clock::time_point start_time_;  // of step 0
  std::uint64_t status_samples_ = 0;
  RunPhase phase_ = PHASE_WAITING;
  std::uint64_t step_ = 0;
  std::string controller_name_;
};

}  // namespace sls::sim
