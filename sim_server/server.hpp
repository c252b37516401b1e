/// The server: claims its vehicle, then flies one run after the other, as long as the operator
/// resets. One thread works; the middleware's threads only fill mailboxes.
#pragma once

#include <cstdint>
#include <memory>

#include "common/bus/node.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/endpoints.hpp"
#include "sim_server/run.hpp"

namespace sls::sim {

class Server {
 public:
  /// Joins the domain of `node` with the scenario in force.
  Server(bus::Node& node, const config::Scenario& scenario);

  /// Runs from the claim to the end. Returns when the recorders are done.
  /// @throws app::RunError saying why the run failed, after the participants have been told.
  void run();

 private:
  std::unique_ptr<Run> make_run(bool begins_paused);
  void claim_vehicle(const Run& run);
  /// Keeps the writers until the recorders, of which so many are expected, are done with `run`.
  void linger(const Run& run, int expected_recorders);

  const config::Scenario scenario_;
  const std::uint32_t vehicle_id_ = 0;
  Endpoints endpoints_;
};

}  // namespace sls::sim
