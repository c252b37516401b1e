/// The client: joins a server's run, answers every state sample, ends with the run.
///
/// A sample is answered on the middleware's thread, on which it arrives: the step waits for the
/// answer, and handing the sample to another thread would make the round trip a quarter longer.
/// A write on that thread must never block (common/bus/fastdds/README.md, trap 4), so the profile
/// of the loop's writers keeps only the last samples.
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/app/stop_signal.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"
#include "control_client/answer_stream.hpp"
#include "control_client/answerer.hpp"
#include "control_client/core/client_core.hpp"
#include "control_client/laws/control_law.hpp"

namespace sls::control {

/// Returns "expected 1 to 32 letters, …, got 'NAME'" if a client cannot have this name; else empty.
std::string describe_name_defect(const std::string& name);

struct ClientOptions {
  std::string name = "control_client";  ///< in recordings and messages
  std::int32_t strength = 0;            ///< among several clients of a vehicle the strongest flies
  /// When another server replaces the present one: true: the client continues with it; false: the
  /// client ends.
  bool follows_servers = false;
  bool checks_purity = false;  ///< as of FlightController
  LawMaker make_law = &make_control_law;
  /// Called 50 times a second. True ends the client before the end of the run.
  std::function<bool()> is_stopped = [] { return app::stop_signal() != 0; };
};

class Client {
 public:
  /// Flies the vehicles of `vehicle_ids` (ascending, at least one) that its server has.
  /// @throws config::ConfigError if the law cannot be made.
  Client(bus::Node& node, const config::Scenario& scenario,
         const std::vector<std::uint32_t>& vehicle_ids, const ClientOptions& options);

  /// Joins a run and answers its states until it ends; also the runs that follow it after a reset.
  /// Call it once.
  /// @throws config::ConfigError if the server flies another scenario.
  /// @throws app::RunError if no server is found, it disappears, or the run fails.
  void run();

 private:
  using Clock = std::chrono::steady_clock;

  std::unique_ptr<AnswerStream> make_stream(bool is_realtime);
  /// Looks once; returns what is to be done.
  ClientCore::Act look();
  void act(ClientCore::Act act);
  std::string describe_obstacles() const;
  void begin();

  /// Called by the middleware for every sample of states.
  void receive(const States& sample, const bus::PeerId& sender);
  /// Answers the states of the joined run and ignores those of other servers.
  void answer(const States& sample, const bus::PeerId& sender);
  /// Reports that `sender`, which is not our server, has sent states of our run.
  void note_impostor(const bus::PeerId& sender);
  /// Tries again at the next call if an answer is being computed.
  void rethrow_answer_error();

  bus::Node& node_;
  const config::Scenario scenario_;
  const ClientOptions options_;

  bus::ServerDirectory servers_;
  bus::Announcer announcer_;
  ClientCore core_;

  // Shared between the main thread and the middleware's.
  std::mutex answer_mutex_;             // guards all that `answer` uses
  std::unique_ptr<Answerer> answerer_;  // of the run that is joined
  std::exception_ptr answer_error_;
  bus::PeerId impostor_;  // the last one that was reported
  /// Made for the mode of the scenario, and made again if the run has another mode.
  std::unique_ptr<AnswerStream> stream_;  // last: its callbacks use the members above
};

}  // namespace sls::control
