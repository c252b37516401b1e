/// Puts the batches of sls/record in order and hands on their steps. No files, no network, no clock
/// here.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"
#include "recorder/rows.hpp"

namespace sls::record {

/// Entries dropped on purpose, by reason.
struct DroppedEntries {
  std::uint64_t repeated = 0;      ///< of a batch or step that has been handled
  std::uint64_t out_of_range = 0;  ///< of a vehicle, kind or step that cannot be
};

/// Batches are handled by their index, entries in the order of the stream. A step that went by
/// without an answer waits for a late one, and what follows it waits with it: rows are in order.
class Stream {
 public:
  using Duration = std::chrono::steady_clock::duration;
  using Sink = std::function<void(const StepRows&)>;
  /// Called where a vehicle's steps [from, to] are not in the stream.
  using GapSink =
      std::function<void(std::uint32_t vehicle_id, std::uint64_t from, std::uint64_t to)>;

  /// Steps before `first_step` are left out. `parameters` must outlive it.
  Stream(const Parameters& parameters, std::uint64_t first_step, Sink sink, GapSink gap_sink);

  /// The first batch may have any index: a writer's history is finite. Batches ahead of a missing
  /// one wait until 64 do, or for 10 s.
  void add(const RecordBatch& batch);

  /// Tells how much time has passed.
  void pass_time(Duration elapsed);

  /// The batch that the others have waited for since `patience`, in words.
  std::optional<std::string> describe_stuck(Duration patience) const;

  /// True when the last batch of the run has been handled.
  bool has_ended() const { return has_ended_; }

  /// Hands on what there is, whatever is missing before it.
  void give_up();

  /// All vehicles' steps up to here have been handed on or are missing; −1: none.
  std::int64_t last_step() const;

  /// Of each vehicle the step after the last one that came.
  const std::map<std::uint32_t, std::uint64_t>& next_steps() const { return next_steps_; }

  const DroppedEntries& dropped() const { return dropped_; }

 private:
  void handle(const RecordBatch& batch);
  void handle(const RecordEntry& entry);
  void handle_late(const RecordEntry& entry);
  void handle_waiting_batches();
  void skip_missing_batches();
  bool may_be_answered(const StepRows& rows) const;
  void hand_on_settled_steps();

  const Parameters& parameters_;
  const std::uint64_t max_step_;  // of which the time can be told
  const Sink sink_;
  const GapSink gap_sink_;
  std::optional<std::uint64_t> next_batch_;       // nothing before the first one
  std::map<std::uint64_t, RecordBatch> waiting_;  // later ones
  Duration stuck_{};                              // since one was handled, while others wait
  bool has_ended_ = false;
  std::map<std::uint32_t, std::uint64_t> next_steps_;
  std::uint64_t newest_step_ = 0;
  std::deque<StepRows> pending_;
  DroppedEntries dropped_;
};

}  // namespace sls::record
