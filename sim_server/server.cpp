#include "sim_server/server.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

#include "common/app/run_main.hpp"
#include "common/app/wait.hpp"
#include "sim_server/core/claim.hpp"
#include "sim_server/lockstep_run.hpp"
#include "sim_server/realtime_run.hpp"

namespace sls::sim {

using namespace std::chrono_literals;

Server::Server(bus::Node& node, const Assignment& assignment, std::size_t threads)
    : assignment_(assignment),
      workers_(std::min(threads, assignment.vehicle_ids.size())),
      endpoints_(node, assignment.vehicle_ids.size(), assignment.scenario.sync.mode) {}

void Server::run() {
  auto run = make_run(false);
  try {
    claim_vehicles(*run);
    // A run is kept until its successor is made: if that fails, the run reports it to the
    // participants.
    while (run->execute() == Run::End::kReset) run = make_run(run->is_paused());
  } catch (const std::exception& error) {
    run->fail(error.what());
    if (run->is_known()) linger(*run, 0);
    throw app::RunError(error.what());
  }
  linger(*run, run->expected_recorders());
}

std::unique_ptr<Run> Server::make_run(bool begins_paused) {
  const std::uint64_t run_id = make_run_id();
  if (assignment_.scenario.sync.mode == config::SyncMode::kRealtime)
    return std::make_unique<RealtimeRun>(endpoints_, assignment_, workers_, run_id, begins_paused);
  return std::make_unique<LockstepRun>(endpoints_, assignment_, workers_, run_id, begins_paused);
}

void Server::claim_vehicles(const Run& run) {
  const auto began = std::chrono::steady_clock::now();
  while (true) {
    // Of two servers the one that looks later finds the port of the other open and waits for its
    // claim, however slow discovery is.
    const bool is_settled = is_claim_settled(std::chrono::steady_clock::now() - began,
                                             endpoints_.domain.stays_on_this_machine(),
                                             endpoints_.servers.has_heard_every_claim());
    Run::check_stop();
    run.check_claim();  // after the look at the claims: one may have come since
    if (is_settled) return;
    std::this_thread::sleep_for(app::kShortPollTime);
  }
}

void Server::linger(const Run& run, int expected_recorders) {
  // The recorders first, because this wait names those that are not done.
  bus::wait_for_recorders_to_end(endpoints_.participants, run.run_id(), expected_recorders);
  endpoints_.record_writer.wait_for_acknowledgments(1s);
  endpoints_.status_writer.wait_for_acknowledgments(1s);
}

}  // namespace sls::sim
