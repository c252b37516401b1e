#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <utility>
#include <variant>

#include "sim_server/core/command_sample.hpp"
#include "sls.h"

namespace sls::sim {

/// The events for the core that must wait for the main thread, in the order of their arrival.
/// Bounded for each kind, so a flood of commands displaces no request. `put` never blocks.
class EventQueue {
 public:
  using Event = std::variant<CommandSample, SimControl>;
  static constexpr std::size_t kMostCommands = 4096;
  static constexpr std::size_t kMostRequests = 64;

  /// Drops an event that does not fit: clients and operators repeat what gets no answer.
  void put(Event event);
  /// All events, oldest first.
  std::deque<Event> take_all();
  bool is_empty() const { return is_empty_; }
  /// Drops the commands.
  void clear_commands();

  /// Waits for an event or `interrupt`; false if `deadline` passes first.
  bool wait(std::chrono::steady_clock::time_point deadline);
  /// Ends the current `wait`, or the next one if no thread waits now.
  void interrupt();

 private:
  std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<Event> events_;
  std::size_t counts_[std::variant_size_v<Event>] = {};
  bool is_interrupted_ = false;
  std::atomic<bool> is_empty_{true};
};

}  // namespace sls::sim
