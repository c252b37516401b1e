#include "sim_server/endpoints.hpp"

#include <utility>

namespace sls::sim {

CommandStream::CommandStream(bus::Node& node, config::SyncMode mode,
                             app::Mailbox<ReceivedCommands>& mailbox)
    : mailbox_(mailbox),
      reader_(
          node,
          mode == config::SyncMode::kRealtime
              ? node.choose_reader_profile(bus::kRealtimeCommandReaderProfile,
                                           bus::kLoopReaderProfile)
              : bus::kLoopReaderProfile,
          [this](const Commands& sample, const bus::PeerId& sender) { receive(sample, sender); }) {}

void CommandStream::set_handler(Handler handler) {
  const std::lock_guard lock(mutex_);
  handler_ = std::move(handler);
}

std::map<bus::PeerId, double> CommandStream::take_stamps_ahead() {
  const std::lock_guard lock(mutex_);
  return stamps_.take();
}

void CommandStream::receive(const Commands& sample, const bus::PeerId& sender) {
  const std::lock_guard lock(mutex_);
  stamps_.note(sender, reader_.written(), std::chrono::system_clock::now);
  if (handler_ && handler_(sample, sender)) return;
  mailbox_.put({sample, sender, std::chrono::steady_clock::now(), reader_.written()});
}

}  // namespace sls::sim
