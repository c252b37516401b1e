/// The shell of the server: threads, clocks and the network around sim_server/core. It claims its
/// vehicles, then flies a run, and another one after each reset.
///
/// In lockstep the core is called on the middleware's thread that delivers an answer; there it also
/// publishes the next state, because waking the main thread would make a step a fifth longer. This
/// thread only tries to lock the core. If that fails, or if other events wait, the sample waits for
/// the main thread. In real time every event goes to the main thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "common/bus/node.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/core/server_core.hpp"
#include "sim_server/domain_view.hpp"
#include "sim_server/endpoints.hpp"
#include "sim_server/event_queue.hpp"
#include "sim_server/outbox.hpp"
#include "sim_server/worker_pool.hpp"

namespace sls::sim {

/// The scenario and the vehicles of a server.
struct Assignment {
  config::Scenario scenario;
  std::vector<std::uint32_t> vehicle_ids;  ///< of the scenario's, ascending; at least one
};

class Server {
 public:
  /// Joins the domain of `node` with the scenario of `assignment`. `threads` ≥ 1 integrate the
  /// vehicles; the result does not depend on their number.
  Server(bus::Node& node, const Assignment& assignment, std::size_t threads);

  /// Runs from the claim to the end. Returns when the recorders are done.
  /// @throws app::RunError with the reason if a run failed, after the failure was published.
  void run();

 private:
  using Clock = std::chrono::steady_clock;

  /// Makes the core of a new run and announces the run. `start` lacks the run id.
  std::unique_ptr<ServerCore> make_core(ServerCore::Start start);
  /// Drives the core to its end.
  void fly(ServerCore& core);
  void write_waiting(ServerCore& core);
  void wait_until_due();
  void deliver_events(ServerCore& core);
  /// Keeps the writers until the recorders are done with the run of `core`.
  void linger(const ServerCore& core);

  // On threads of the middleware.
  void receive(const Commands& sample, const bus::PeerId& sender);
  /// Passes a sample to the core; false if the main thread must do so.
  bool pass_on(const Commands& sample, const bus::PeerId& sender);
  /// Fills in the sample that is being received.
  void fill(CommandSample& received, const Commands& sample, const bus::PeerId& sender) const;

  const Assignment assignment_;
  const bool is_lockstep_;
  WorkerPool workers_;
  EventQueue events_;

  std::mutex core_mutex_;       // of the core that core_ points to
  CommandSample received_;      // under the mutex: reused for each sample
  ServerCore* core_ = nullptr;  // under the mutex; while it flies
  std::atomic<bool> main_wants_core_{false};
  std::atomic<sync::Time> deadline_{sync::Time()};      // of the core
  std::atomic<sync::Time> sleeps_until_{sync::Time()};  // the main thread

  Endpoints endpoints_;  // after all that its handlers use
  Outbox outbox_;
  DomainView view_;
};

}  // namespace sls::sim
