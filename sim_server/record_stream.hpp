/// Sends the steps of a run to the recorders. The loop collects them; a separate thread writes them
/// as batches of sls/record.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "common/bus/message_size.hpp"
#include "common/bus/node.hpp"
#include "common/model/step_record.hpp"

namespace sls::sim {

/// Entries in batches, in their order. A batch has as many as fit into a datagram. Entries that
/// have been written keep their memory for later ones.
class RecordBatches {
 public:
  /// Batches of run `run_id` have at most `max_bytes`, unless one entry is larger.
  RecordBatches(std::size_t max_bytes, std::uint64_t run_id)
      : max_bytes_(max_bytes), run_id_(run_id) {}

  void add(const model::StepRecord& record);
  /// Entries that were added since the last `clear`.
  std::size_t count() const { return count_; }

  /// Calls `write(batch)` for each batch. They count from `next_batch`, which becomes the number of
  /// the next one. If `is_last`, the run has no later ones, and there is a last batch in any case.
  template <class Write>
  void write(std::uint64_t& next_batch, bool is_last, const Write& write) {
    if (used_ == 0 && is_last) begin_batch();
    for (std::size_t i = 0; i < used_; ++i) {
      auto& [batch, entries] = batches_[i];
      batch.entries().resize(entries);
      batch.batch_index(next_batch++);
      batch.is_last(is_last && i + 1 == used_);
      write(static_cast<const RecordBatch&>(batch));
    }
  }
  void clear() { used_ = count_ = 0; }

  /// Batches of the largest step so far.
  std::size_t batches_of_step() const { return step_bytes_ / max_bytes_ + 1; }

 private:
  struct Batch {
    RecordBatch message;  // only the first `entries` are valid
    std::size_t entries = 0;
  };

  void begin_batch();
  RecordEntry& next_entry();
  void note_size(std::uint64_t step, std::size_t bytes);

  std::size_t max_bytes_;
  std::uint64_t run_id_;
  std::vector<Batch> batches_;  // only the first `used_` are valid
  std::size_t used_ = 0;
  std::size_t bytes_ = 0;          // of the last of them
  std::size_t count_ = 0;          // entries of all
  std::uint64_t step_ = 0;         // of the last entry
  std::size_t bytes_of_step_ = 0;  // of its entries
  std::size_t step_bytes_ = 0;     // of the largest step
};

class RecordStream {
 public:
  /// Number of steps, and time, after which the collected entries are written.
  static constexpr std::size_t kMostSteps = 64;
  static constexpr auto kLongestWait = std::chrono::milliseconds(20);
  /// Room for entries that are not written yet.
  static constexpr std::size_t kMostCollected = 32'768;

  /// Batches of run `run_id` have at most `max_bytes`, unless one entry is larger.
  RecordStream(bus::Writer<RecordBatch>& writer, std::size_t max_bytes, std::uint64_t run_id);
  ~RecordStream() { end(); }
  RecordStream(const RecordStream&) = delete;
  RecordStream& operator=(const RecordStream&) = delete;

  /// Collects the records of one step. Blocks only while the thread swaps two pointers.
  void add_step(const std::vector<model::StepRecord>& records);

  /// Makes the thread write all collected entries now: for a run at rest.
  void flush();
  /// Writes the remaining entries and the last batch of the run. If the middleware refuses a batch,
  /// after `max_blocking_time`, the rest is lost. Later entries are lost, too.
  void end();

  /// True while the thread is far behind: more than half of the room is used. The lockstep loop
  /// then waits.
  bool is_full() const { return is_full_; }
  /// Entries that were written so far: shows that the thread makes progress.
  std::uint64_t written() const { return written_; }
  /// Entries that were lost because there was no room, or the middleware refused them.
  std::uint64_t lost() const { return lost_; }
  /// Least number of steps whose batches the writer keeps for late recorders.
  std::uint64_t history_steps() const;

 private:
  static constexpr std::size_t kManyEntries = 512;

  void work();
  void write(const RecordBatch& batch);

  bus::Writer<RecordBatch>& writer_;
  std::mutex mutex_;
  std::condition_variable wake_;
  RecordBatches collected_;  // under the mutex
  std::size_t steps_ = 0;    // likewise: those of its entries
  bool is_due_ = false;      // likewise
  bool is_ended_ = false;    // likewise
  std::atomic<bool> is_full_{false};
  std::atomic<std::uint64_t> written_{0};
  std::atomic<std::uint64_t> lost_{0};
  std::atomic<std::size_t> batches_of_step_{1};  // of the largest step so far
  RecordBatches writing_;                        // used by the thread alone
  std::uint64_t next_batch_ = 0;                 // likewise
  bool has_given_up_ = false;                    // likewise: a batch was refused after the end
  std::thread thread_;                           // last: it uses the members above
};

}  // namespace sls::sim
