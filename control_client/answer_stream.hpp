/// The client's end of the control loop: states in, commands out.
#pragma once

#include <functional>

#include "common/bus/node.hpp"

namespace sls::control {

class AnswerStream {
 public:
  /// Receives each sample of states, on a thread of the middleware.
  using Handler = std::function<void(const States& sample, const bus::PeerId& sender)>;

  /// If `is_realtime`, commands are written with DEADLINE, provided that the QoS file has that
  /// profile.
  AnswerStream(bus::Node& node, bool is_realtime, Handler handler)
      : is_realtime_(is_realtime),
        commands_(node, is_realtime ? node.choose_writer_profile(bus::kRealtimeCommandWriterProfile,
                                                                 bus::kLoopWriterProfile)
                                    : bus::kLoopWriterProfile),
        states_(node, bus::kLoopReaderProfile, std::move(handler)) {}

  bool is_realtime() const { return is_realtime_; }

  /// Publishes the answers to one sample of states.
  void write(const Commands& answers) { commands_.write(answers); }

  /// True if reader and writer are both matched with `server`.
  bool sees_server(const bus::PeerId& server) const {
    return states_.matched().count(server) > 0 && commands_.matched().count(server) > 0;
  }

 private:
  const bool is_realtime_;
  bus::Writer<Commands> commands_;
  bus::Reader<States> states_;  // last: its handler uses the writer
};

}  // namespace sls::control
