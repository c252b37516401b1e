#include "sim_server/server.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/app/awake_clock.hpp"
#include "common/app/log.hpp"
#include "common/app/run_error.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/version.hpp"
#include "common/app/wait.hpp"
#include "common/bus/spinning.hpp"
#include "common/config/vehicle_ids.hpp"
#include "sim_server/messages.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

void log_run(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
             std::uint64_t run_id) {
  const config::Sync& sync = scenario.sync;
  const std::string mode = sync.mode == config::SyncMode::kLockstep
                               ? "lockstep"
                               : fmt::format("real time × {}", sync.real_time_factor);
  spdlog::info("run {:016x}: {}, vehicle{} {}, {}, period {} s, step {} s", run_id, scenario.name,
               ids.size() > 1 ? "s" : "", config::to_vehicle_ranges(ids), mode,
               sync.period_ns / 1e9, scenario.plant.step_ns / 1e9);
}

}  // namespace

Server::Server(bus::Node& node, const Assignment& assignment, std::size_t threads)
    : assignment_(assignment),
      workers_(std::min(threads, assignment.vehicle_ids.size())),
      loop_(assignment.scenario.sync.mode == config::SyncMode::kLockstep, view_, outbox_),
      endpoints_(
          node, assignment.scenario.sync.mode,
          [this](const Commands& sample, const bus::PeerId& sender) {
            loop_.put([&](CommandSample& received) { fill(received, sample, sender); });
          },
          [this](const SimControl& request) { loop_.put(request); }),
      outbox_(endpoints_),
      view_(endpoints_, outbox_) {}

void Server::run() {
  auto core = make_core({});
  while (true) {
    loop_.run(*core);
    bus::stop_spinning();
    if (core->end() != ServerCore::End::kReset) break;
    try {
      core = make_core(core->make_next_start());
    } catch (const std::exception& error) {
      // The ended run tells the participants that it has no successor.
      core->on_failure(error.what(), app::awake_clock().now());
      loop_.write_waiting(*core);
      break;
    }
  }
  if (core->is_known()) linger(*core);
  if (!core->error().empty()) throw app::RunError(core->error());
}

std::unique_ptr<ServerCore> Server::make_core(ServerCore::Start start) {
  const config::Scenario& scenario = assignment_.scenario;
  start.run_id = make_run_id();
  auto fleet = std::make_unique<Fleet>(
      scenario, assignment_.vehicle_ids, start.run_id,
      [this](std::size_t count, const std::function<void(std::size_t)>& work) {
        workers_.for_each(count, work);
      });
  outbox_.begin_run(scenario.sync, start.run_id);
  endpoints_.parameters.write(make_parameters_message(start.run_id, assignment_.vehicle_ids,
                                                      scenario, fleet->plant(), app::version()));
  log_run(scenario, assignment_.vehicle_ids, start.run_id);
  return std::make_unique<ServerCore>(scenario, start, std::move(fleet), outbox_,
                                      app::awake_clock().now());
}

void Server::linger(const ServerCore& core) {
  Leaving leaving = core.leave(app::awake_clock().now());
  const auto look = [&] {
    const bool is_acknowledged = endpoints_.records.wait_for_acknowledgments(0s) &&
                                 endpoints_.status.wait_for_acknowledgments(0s) &&
                                 endpoints_.replies.wait_for_acknowledgments(0s);
    const auto& participants = endpoints_.participants;
    return leaving.look({participants.find(ParticipantRole::ROLE_RECORDER, core.run_id()),
                         participants.count_done(ParticipantRole::ROLE_RECORDER, core.run_id()),
                         app::stop_signal() != 0, is_acknowledged},
                        app::awake_clock().now());
  };
  for (bool is_over = false; !is_over;) {
    is_over = look();
    for (const sync::Line& line : leaving.take_lines()) app::log(line);
    if (!is_over) app::sleep_for(app::kShortPollTime);
  }
  if (!leaving.error().empty()) throw app::RunError(leaving.error());
}

void Server::fill(CommandSample& received, const Commands& sample,
                  const bus::PeerId& sender) const {
  received.sender = sender;
  received.arrived = {app::awake_clock().now(), std::chrono::system_clock::now()};
  received.written = endpoints_.commands.written();
  sim::fill(received, sample);
}

}  // namespace sls::sim
