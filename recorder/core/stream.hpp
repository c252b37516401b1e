/// Puts the batches of sls/record in order and passes on their steps. No files, no network, no
/// clock here.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "common/sync/patience.hpp"
#include "recorder/core/gaps.hpp"
#include "recorder/rows.hpp"
#include "sls.h"

namespace sls::record {

/// Entries dropped on purpose, by reason.
struct DroppedEntries {
  std::uint64_t repeated = 0;      ///< batch or step was handled before
  std::uint64_t out_of_range = 0;  ///< impossible vehicle, kind or step
};

/// Batches are handled in the order of their index, entries in the order of the stream. A step
/// without an answer waits for a late answer. The later steps wait with it, so rows are in order.
class Stream {
 public:
  using Sink = std::function<void(const StepRows&)>;
  /// Called if a vehicle's steps [from, to] are not in the stream.
  using GapSink =
      std::function<void(std::uint32_t vehicle_id, std::uint64_t from, std::uint64_t to)>;

  /// Steps before `first_step` are left out.
  Stream(const Parameters& parameters, std::uint64_t first_step, Sink sink, GapSink gap_sink);

  /// Adds the next step of a vehicle, without a batch. Not together with batches.
  void add(const model::StepRecord& record);

  /// The first batch may have any index, because a writer's history is finite. Batches after a
  /// missing one wait for it, until more than 64 of them wait or none has been handled for 10 s. If
  /// none has come at all in this time, no further missing batch is waited for.
  void add(const RecordBatch& batch, sync::Time now);

  /// Call it several times a second.
  void on_time(sync::Time now);

  /// A text with the missing batch, if a line about it is due: after 1 s, then every 5 s.
  std::optional<std::string> take_report(sync::Time now);

  /// True when the last batch of the run has been handled.
  bool has_ended() const { return has_ended_; }

  /// Passes on all that has arrived, without waiting for missing batches and answers.
  void give_up();

  /// The step up to which all vehicles' steps have come or are missing; −1: none. Steps that are
  /// kept for late answers have come: the server need not wait for them.
  std::int64_t last_step() const;

  /// For each vehicle, the step after the last one that came.
  const std::map<std::uint32_t, std::uint64_t>& next_steps() const { return next_steps_; }

  const DroppedEntries& dropped() const { return dropped_; }

  /// The batches that were not waited for any longer. After `give_up` also the next one, if the last
  /// one of the run has not come. A batch without steps had only late answers.
  const MissingSamples& missing_batches() const { return missing_batches_.missing(); }

 private:
  void handle(const RecordBatch& batch);
  /// Handles the record in `next_`.
  void handle_next();
  void handle_late(const model::StepRecord& late);
  void handle_waiting_batches();
  void skip_missing_batches();
  /// From the next batch to `last`.
  void note_missing_batches(std::uint64_t last);
  void begin_to_wait(sync::Time now);
  bool may_be_answered(const StepRows& rows) const;
  void hand_on_settled_steps();

  const RowFormat format_;
  const std::uint64_t max_step_;  // its time in ns still fits 64 bits
  const Sink sink_;
  const GapSink gap_sink_;
  std::optional<std::uint64_t> next_batch_;       // empty before the first batch
  std::map<std::uint64_t, RecordBatch> waiting_;  // batches after next_batch_
  std::optional<sync::Patience> stuck_;  // with the missing batch, since the last handled one
  bool is_quiet_ = true;                 // no batch has come since then
  bool has_ended_ = false;
  std::map<std::uint32_t, std::uint64_t> next_steps_;
  std::uint64_t newest_step_ = 0;
  StepRows next_;  // its memory is used again for each step
  std::deque<StepRows> pending_;
  DroppedEntries dropped_;
  GapList missing_batches_;
};

}  // namespace sls::record
