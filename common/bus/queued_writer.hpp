/// A writer with its own thread, for loops that must never block on a reader.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <thread>

#include "common/app/mailbox.hpp"
#include "common/bus/node.hpp"

namespace sls::bus {

/// Passes messages to `writer` in order, from a bounded queue. A message that does not fit, or that
/// the middleware refuses, is counted and not published.
template <class Message>
class QueuedWriter {
 public:
  QueuedWriter(Writer<Message>& writer, std::size_t capacity)
      : writer_(writer), queue_(capacity), thread_([this] { work(); }) {}

  /// Writes the queued messages first. If the middleware refuses one, after `max_blocking_time`,
  /// the rest is lost.
  ~QueuedWriter() {
    stop_ = true;
    thread_.join();
  }
  QueuedWriter(const QueuedWriter&) = delete;
  QueuedWriter& operator=(const QueuedWriter&) = delete;

  /// Never blocks.
  void write(const Message& message) { queue_.put(message); }

  /// Messages that were lost so far.
  std::uint64_t lost() const { return queue_.refused() + refused_by_middleware_; }

 private:
  void work() {
    constexpr auto kLongestSleep = std::chrono::milliseconds(50);
    while (true) {
      const bool is_stopping = stop_;
      const auto message = queue_.take(std::chrono::steady_clock::now() +
                                       (is_stopping ? kLongestSleep * 0 : kLongestSleep));
      if (!message && is_stopping) return;
      if (!message) continue;
      try {
        writer_.write(*message);
      } catch (const BusError&) {
        ++refused_by_middleware_;
        if (stop_) return;  // each further message would block as long
      }
    }
  }

  Writer<Message>& writer_;
  app::Mailbox<Message> queue_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> refused_by_middleware_{0};
  std::thread thread_;  // last: it uses the members above
};

}  // namespace sls::bus
