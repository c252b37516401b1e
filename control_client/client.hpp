/// The client: joins a server's run, answers every state sample, ends with the run. One thread
/// works; the middleware's threads only fill the mailbox.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
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
  void linger();

  void answer(const VehicleState& state);
  bool sees_all_endpoints() const;
  void announce(bool ready, bool done);
  /// True when the run has ended, well or not.
  /// @throws app::RunError if it has not, but its server is gone.
  bool has_ended() const;

  config::Scenario scenario_;  // with the period in force once a run is joined
  const std::string name_;
  const std::int32_t strength_;
  const std::uint32_t vehicle_id_ = 0;

  bus::ParticipantDirectory participants_;
  bus::ServerDirectory servers_;
  bus::Writer<Participant> participant_writer_;
  bus::Writer<ControlCommand> command_writer_;
  bus::Writer<Reference> reference_writer_;
  app::Mailbox<VehicleState> states_;
  bus::Reader<VehicleState> state_reader_;

  std::optional<bus::Run> run_;
  std::unique_ptr<FlightController> controller_;
  bool ready_ = false;
  std::optional<ControlCommand> last_command_;  // a repeated sample is answered from here
};

}  // namespace sls::control
