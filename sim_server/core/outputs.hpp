#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "common/sync/line.hpp"
#include "common/sync/time.hpp"
#include "sim_server/core/answers/command_gate.hpp"
#include "sls.h"

namespace sls::sim {

class Fleet;
class Vehicle;

/// One moment on both clocks.
struct Moment {
  sync::Time time{};
  std::chrono::system_clock::time_point wall{};  ///< the clock that sample stamps use
  sync::Duration stopped{0};                     ///< for which the program was stopped until then
};

/// The orders of a server's core to its shell. No function blocks or calls the core. States
/// and records leave at once; everything else may leave a little later, in the given order.
class Outputs {
 public:
  virtual ~Outputs() = default;

  /// Sends the states of the step in work. Returns the moment at which the first one left.
  virtual Moment send_states(const Fleet& fleet) = 0;
  /// Sends them again: the samples that hold a vehicle for which `is_wanted(index)` is true.
  virtual void resend_states(const Fleet& fleet,
                             const std::function<bool(std::size_t)>& is_wanted) = 0;

  /// Records the step in work.
  virtual void record_step(const Fleet& fleet) = 0;
  /// Records an answer that came too late for its step.
  virtual void record_late(const Vehicle& vehicle, const OfferedAnswer& answer) = 0;
  /// True while the recorded entries are far from being sent: a lockstep run then waits.
  virtual bool is_record_full() const = 0;
  /// States and record entries that could not be sent so far.
  virtual std::uint64_t lost() const = 0;
  /// Sends all recorded entries soon, because the run rests.
  virtual void flush_records() = 0;
  /// Sends the remaining entries. All that is sent or logged later leaves after them.
  virtual void end_records() = 0;

  virtual void send(const SimStatus& status) = 0;
  virtual void send(const SimControlReply& reply) = 0;
  virtual void log(sync::Line line) = 0;
  /// Shows the progress of a real-time run on a terminal, where a flight that prints nothing for
  /// long looks as if it hung.
  virtual void show_progress(std::string text) = 0;

  /// The flight begins: the shell prepares its threads.
  virtual void begin_flight() = 0;
  /// While true, commands expire by their step alone, not by LIFESPAN.
  virtual void ignore_lifespan(bool is_ignored) = 0;
};

}  // namespace sls::sim
