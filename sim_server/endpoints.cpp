#include "sim_server/endpoints.hpp"

#include <utility>

namespace sls::sim {
namespace {

const char* choose_profile(const bus::Node& node, config::SyncMode mode, const char* realtime,
                           const char* lockstep) {
  return mode == config::SyncMode::kRealtime ? node.choose_reader_profile(realtime, lockstep)
                                             : lockstep;
}

}  // namespace

CommandStream::CommandStream(bus::Node& node, std::size_t vehicles, config::SyncMode mode,
                             app::Mailbox<ReceivedCommand>& mailbox)
    : mailbox_(mailbox) {
  if (vehicles == 1)
    vehicle_reader_.emplace(
        node,
        choose_profile(node, mode, bus::kRealtimeCommandReaderProfile, bus::kLoopReaderProfile),
        [this](const ControlCommand& command, const bus::PeerId& sender) {
          receive(&command, 1, sender);
        });
  else
    fleet_reader_.emplace(node,
                          choose_profile(node, mode, bus::kRealtimeFleetCommandReaderProfile,
                                         bus::kFleetLoopReaderProfile),
                          [this](const FleetCommand& sample, const bus::PeerId& sender) {
                            receive(sample.vehicles().data(), sample.vehicles().size(), sender);
                          });
}

void CommandStream::set_handler(Handler handler) {
  const std::lock_guard lock(mutex_);
  handler_ = std::move(handler);
}

void CommandStream::receive(const ControlCommand* commands, std::size_t count,
                            const bus::PeerId& sender) {
  const std::lock_guard lock(mutex_);
  if (handler_ && handler_(commands, count, sender)) return;
  for (std::size_t i = 0; i < count; ++i) mailbox_.put({commands[i], sender});
}

std::uint64_t CommandStream::missed_deadlines() const {
  return vehicle_reader_ ? vehicle_reader_->missed_deadlines() : fleet_reader_->missed_deadlines();
}

std::optional<std::chrono::nanoseconds> CommandStream::lifespan() const {
  return vehicle_reader_ ? vehicle_reader_->lifespan() : fleet_reader_->lifespan();
}

void CommandStream::ignore_lifespan() {
  vehicle_reader_ ? vehicle_reader_->ignore_lifespan() : fleet_reader_->ignore_lifespan();
}

}  // namespace sls::sim
