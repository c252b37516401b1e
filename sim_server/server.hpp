/// The server: claims its vehicles, then flies one run after the other, as long as the operator
/// resets.
#pragma once

#include <cstdint>
#include <memory>

#include "common/bus/node.hpp"
#include "sim_server/endpoints.hpp"
#include "sim_server/run.hpp"

namespace sls::sim {

class Server {
 public:
  /// Joins the domain of `node` with the scenario in force. `threads` ≥ 1 integrate the vehicles;
  /// the result does not depend on how many.
  Server(bus::Node& node, const Assignment& assignment, std::size_t threads);

  /// Runs from the claim to the end. Returns when the recorders are done.
  /// @throws app::RunError saying why the run failed, after the participants have been told.
  void run();

 private:
  std::unique_ptr<Run> make_run(bool begins_paused);
  void claim_vehicles(const Run& run);
  /// Keeps the writers until the recorders, of which so many are expected, are done with `run`.
  void linger(const Run& run, int expected_recorders);

  const Assignment assignment_;
  WorkerPool workers_;
  Endpoints endpoints_;
};

}  // namespace sls::sim
