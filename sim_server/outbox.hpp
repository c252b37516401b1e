#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <variant>
#include <vector>

#include "common/config/scenario.hpp"
#include "sim_server/backlog.hpp"
#include "sim_server/core/outputs.hpp"
#include "sim_server/endpoints.hpp"
#include "sim_server/record_stream.hpp"

namespace sls::sim {

/// Does what the core wants. States and records leave at once, on the thread that calls the core.
/// A write to a reliable topic may block, so everything else waits here for the main thread.
class Outbox : public Outputs, public Backlog {
 public:
  explicit Outbox(Endpoints& endpoints) : endpoints_(endpoints) {}

  /// Begins run `run_id`. The core of an earlier run must have ended.
  /// @throws std::system_error if there is no thread for it; nothing has changed then.
  void begin_run(const config::Sync& sync, std::uint64_t run_id);

  /// True if something waits for the main thread.
  bool is_waiting() const override { return is_waiting_; }
  /// Writes what waits. On the main thread, without a lock.
  /// @throws bus::BusError if a write is refused: the rest is lost.
  void write_waiting() override;

  std::uint64_t written_records() const { return records_->written(); }
  /// Steps whose records are kept for late recorders.
  std::uint64_t history_steps() const { return records_->history_steps(); }

  Moment send_states(const Fleet& fleet) override;
  void resend_states(const Fleet& fleet,
                     const std::function<bool(std::size_t)>& is_wanted) override;
  void record_step(const Fleet& fleet) override;
  void record_late(const Vehicle& vehicle, const OfferedAnswer& answer) override;
  bool is_record_full() const override { return records_->is_full(); }
  std::uint64_t lost() const override { return endpoints_.states.lost() + records_->lost(); }
  void flush_records() override { records_->flush(); }
  void end_records() override { put(EndRecords()); }
  void send(const SimStatus& status) override { put(status); }
  void send(const SimControlReply& reply) override { put(reply); }
  void log(sync::Line line) override { put(std::move(line)); }
  void show_progress(std::string text) override;
  void begin_flight() override;
  void ignore_lifespan(bool is_ignored) override {
    endpoints_.commands.ignore_lifespan(is_ignored);
  }

 private:
  struct EndRecords {};
  using Item = std::variant<SimStatus, SimControlReply, sync::Line, EndRecords>;

  void put(Item item);
  void write(const SimStatus& status) { endpoints_.status.write(status); }
  void write(const SimControlReply& reply) { endpoints_.replies.write(reply); }
  void write(const sync::Line& line);
  void write(const EndRecords&) { records_->end(); }

  Endpoints& endpoints_;
  bool is_realtime_ = false;
  std::unique_ptr<RecordStream> records_;
  std::mutex mutex_;
  std::deque<Item> waiting_;  // under the mutex
  std::atomic<bool> is_waiting_{false};
};

}  // namespace sls::sim
