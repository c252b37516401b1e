/// The client: joins a server's run, answers every state sample, ends with the run.
///
/// A sample is answered where it arrives, on the middleware's thread: the step waits for the
/// answer, and handing the sample to another thread would make the round trip a quarter longer.
/// Writing there must never block (common/bus/fastdds/README.md, trap 4): the profile of the loop's
/// writers keeps the last samples rather than all of them.
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/app/stop_signal.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"
#include "control_client/answer_stream.hpp"
#include "control_client/flight_controller.hpp"
#include "control_client/laws/control_law.hpp"

namespace sls::control {

/// "expected 1 to 32 letters, …, got 'NAME'" where `name` may not be that of a client; else empty.
std::string describe_name_defect(const std::string& name);

struct ClientOptions {
  std::string name = "control_client";  ///< in recordings and messages
  std::int32_t strength = 0;            ///< among several clients of a vehicle the strongest flies
  /// When another server replaces the one it flies with, it flies on with that one; else it ends.
  bool follows_servers = false;
  bool checks_purity = false;  ///< as of FlightController
  LawMaker make_law = &make_control_law;
  /// Asked 50 times a second: whether the client is to leave before the run has ended.
  std::function<bool()> is_stopped = [] { return app::stop_signal() != 0; };
};

class Client {
 public:
  /// Will fly those of `vehicle_ids` (ascending, at least one) that the server it finds has.
  /// @throws config::ConfigError if the law cannot be made.
  Client(bus::Node& node, const config::Scenario& scenario,
         const std::vector<std::uint32_t>& vehicle_ids, const ClientOptions& options);

  /// Runs from joining to the end of the run, and of those that follow it after a reset.
  /// @throws config::ConfigError if the server flies another scenario.
  /// @throws app::RunError if no server is found, it disappears, or the run fails.
  void run();

 private:
  using Clock = std::chrono::steady_clock;

  /// The run to begin with; nothing once it is stopped.
  std::optional<bus::Run> find_first_run();
  std::unique_ptr<AnswerStream> make_stream(bool is_realtime);
  std::string describe_problem() const;
  /// That of the first of our vehicles that has one.
  std::optional<bus::Run> find_joinable_run() const;
  void begin(const bus::Run& run);
  /// Serves until the run has ended (nothing), or another one has taken its place.
  std::optional<bus::Run> serve();
  void leave();

  /// One of our vehicles in the run that is joined.
  struct Pilot {
    Pilot(const config::Scenario& scenario, std::uint32_t id, const ClientOptions& options)
        : controller(scenario, id, options.checks_purity, options.make_law) {}
    FlightController controller;
    std::optional<std::uint64_t> last_step;
    ControlCommand last_command;  // the answer to that step: a repeated sample gets it again
  };

  /// Called by the middleware for every sample of states.
  void receive(const States& sample, const bus::PeerId& sender);
  /// Answers states of the server whose run is joined; others' are nobody's business here.
  void answer(const States& sample, const bus::PeerId& sender);
  const ControlCommand& answer(Pilot& pilot, std::uint64_t step, const VehicleState& state);
  void announce(bool ready, bool done);
  /// Announces this client while it waits for a server: each writer of sls/command announces
  /// itself.
  void announce_waiting();
  Participant make_announcement(const std::vector<std::uint32_t>& vehicle_ids) const;
  std::int64_t find_last_step();
  /// True when the run has ended, well or not.
  bool has_ended() const;
  /// The run that has taken the place of ours: after a reset, or because the server was replaced.
  /// @throws app::RunError if the server is gone for too long or was replaced, and not to follow.
  std::optional<bus::Run> find_successor();
  void rethrow_answer_error();

  bus::Node& node_;
  config::Scenario scenario_;  // with the period in force once a run is joined
  const ClientOptions options_;
  const std::string library_sha256_;
  const std::vector<std::uint32_t> vehicle_ids_;

  bus::ServerDirectory servers_;
  bus::Writer<Participant> participant_writer_;
  std::optional<bus::Run> run_;
  std::optional<bus::ServerWatch> watch_;
  std::vector<std::uint32_t> flown_ids_;  // of vehicle_ids_, in this run
  bool ready_ = false;

  // Shared between the main thread and the middleware's.
  std::mutex answer_mutex_;  // over all that `answer` touches
  std::map<std::uint32_t, Pilot> pilots_;
  Commands answers_;  // to the sample in work
  std::exception_ptr answer_error_;
  /// Made for what the scenario says, and anew where the run is of another mode.
  std::unique_ptr<AnswerStream> stream_;  // last: its callbacks use the members above
};

}  // namespace sls::control
