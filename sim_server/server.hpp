/// The shell of the server: the network, clocks and threads around sim_server/core. It claims its
/// vehicles, then flies a run, and another one after each reset.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/bus/node.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/core/server_core.hpp"
#include "sim_server/core_loop.hpp"
#include "sim_server/domain_view.hpp"
#include "sim_server/endpoints.hpp"
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
  /// Makes the core of a new run and announces the run. `start` lacks the run id.
  std::unique_ptr<ServerCore> make_core(ServerCore::Start start);
  /// Keeps the writers until the recorders are done with the run of `core`.
  /// @throws app::RunError if an expected recorder does not finish.
  void linger(const ServerCore& core);
  /// Fills in the sample that the reader of commands is receiving.
  void fill(CommandSample& received, const Commands& sample, const bus::PeerId& sender) const;

  const Assignment assignment_;
  WorkerPool workers_;
  CoreLoop loop_;  // before the endpoints: their handlers use it
  Endpoints endpoints_;
  Outbox outbox_;
  DomainView view_;
};

}  // namespace sls::sim
