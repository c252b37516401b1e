/// The server: claims its vehicles, then flies a run, and another one after each reset.
#pragma once

#include <cstdint>
#include <memory>

#include "common/bus/node.hpp"
#include "sim_server/endpoints.hpp"
#include "sim_server/run.hpp"

namespace sls::sim {

class Server {
 public:
  /// Joins the domain of `node` with the scenario of `assignment`. `threads` ≥ 1 integrate the
  /// vehicles; the result does not depend on their number.
  Server(bus::Node& node, const Assignment& assignment, std::size_t threads);

  /// Runs from the claim to the end. Returns when the recorders are done.
  /// @throws app::RunError with the reason if a run failed, after the failure was published.
  void run();

 private:
  std::unique_ptr<Run> make_run(bool begins_paused);
  void claim_vehicles(const Run& run);
  /// Keeps the writers until the recorders, at least `expected_recorders`, are done with `run`.
  void linger(const Run& run, int expected_recorders);

  const Assignment assignment_;
  WorkerPool workers_;
  Endpoints endpoints_;
};

}  // namespace sls::sim
