/// The client: joins a server's run, answers every state sample, ends with the run.
///
/// A sample is answered where it arrives, on the middleware's thread: the step waits for the
/// answer, and handing the sample to another thread would make the round trip a quarter longer.
/// Writing there must never block (common/bus/README.md, trap 4). So when the recorders are so far
/// behind that a history could fill, samples go to the main thread, which may wait.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "common/app/mailbox.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"
#include "control_client/flight_controller.hpp"

namespace sls::control {

class Client {
 public:
  /// Will fly vehicle 0 of `scenario` under `name`; among several clients the strongest flies.
  Client(bus::Node& node, const config::Scenario& scenario, const std::string& name,
         std::int32_t strength);

  /// Runs from joining to the end of the run.
  /// @throws config::ConfigError if the server flies another scenario.
  /// @throws app::RunError if no server is found, it disappears, or the run fails.
  void run();

 private:
  using Clock = std::chrono::steady_clock;

  void join_run();
  void serve();

  /// Called by the middleware for every sample.
  void receive(const VehicleState& state);
  void answer(const VehicleState& state);
  /// Notes how far the recorders are, which decides where samples are answered.
  void look_at_recorders();
  bool sees_all_endpoints() const;
  void announce(bool ready, bool done);
  /// True when the run has ended, well or not.
  /// @throws app::RunError if it has not, but its server is gone.
  bool has_ended();

  config::Scenario scenario_;  // with the period in force once a run is joined
  const std::string name_;
  const std::int32_t strength_;
  const std::uint32_t vehicle_id_ = 0;

  bus::ParticipantDirectory participants_;
  bus::ServerDirectory servers_;
  bus::Writer<Participant> participant_writer_;
  bus::Writer<ControlCommand> command_writer_;
  bus::Writer<Reference> reference_writer_;
  std::optional<bus::Run> run_;
  std::unique_ptr<FlightController> controller_;
  bool ready_ = false;

  // Shared between the main thread and the middleware's.
  std::atomic<bool> answers_at_once_{false};
  std::atomic<std::uint64_t> last_step_at_once_{0};  // up to which no history can fill
  std::mutex answer_mutex_;                          // over all that `answer` touches
  std::optional<ControlCommand> last_command_;       // a repeated sample is answered from here
  std::exception_ptr answer_error_;
  app::Mailbox<VehicleState> states_;
  bus::Reader<VehicleState> state_reader_;  // last: its callbacks use the members above
};

}  // namespace sls::control
