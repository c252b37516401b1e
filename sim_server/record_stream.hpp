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

/// Puts entries into batches, in their order. A batch has as many as fit into a datagram.
class RecordBatches {
 public:
  /// Batches of run `run_id` have at most `max_bytes`, unless one entry is larger.
  RecordBatches(std::size_t max_bytes, std::uint64_t run_id) : max_bytes_(max_bytes) {
    batch_.run_id(run_id);
  }

  /// Calls `write(batch)` for each batch that is full, and for the rest of the `count` entries at
  /// `entries`; if `is_last`, the run has no later ones, and there is a last batch in any case.
  template <class Write>
  void make(const RecordEntry* entries, std::size_t count, bool is_last, const Write& write) {
    const std::size_t header = bus::calc_size(batch_);
    std::size_t bytes = header;
    for (const RecordEntry* entry = entries; entry != entries + count; ++entry) {
      std::size_t more = bus::calc_size(*entry, bytes);
      note_size(entry->step(), more);
      const bool is_full = bytes + more > max_bytes_ || batch_.entries().size() == BATCH_ENTRIES;
      if (is_full && !batch_.entries().empty()) {
        finish(false, write);
        bytes = header;
        more = bus::calc_size(*entry, bytes);
      }
      batch_.entries().push_back(*entry);
      bytes += more;
    }
    if (!batch_.entries().empty() || is_last) finish(is_last, write);
  }

  /// Batches of the largest step so far.
  std::size_t batches_of_step() const { return step_bytes_ / max_bytes_ + 1; }

 private:
  void note_size(std::uint64_t step, std::size_t bytes) {
    bytes_of_step_ = step == step_ ? bytes_of_step_ + bytes : bytes;
    step_ = step;
    step_bytes_ = step_bytes_ > bytes_of_step_ ? step_bytes_ : bytes_of_step_;
  }
  template <class Write>
  void finish(bool is_last, const Write& write) {
    batch_.batch_index(next_batch_++);
    batch_.is_last(is_last);
    write(static_cast<const RecordBatch&>(batch_));
    batch_.entries().clear();
  }

  const std::size_t max_bytes_;
  RecordBatch batch_;
  std::uint64_t next_batch_ = 0;
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
  /// Entries that were written so far: shows that the thread gets on.
  std::uint64_t written() const { return written_; }
  /// Entries that were lost because there was no room, or the middleware refused them.
  std::uint64_t lost() const { return lost_; }
  /// Least number of steps whose batches the writer keeps for late recorders.
  std::uint64_t history_steps() const;

 private:
  static constexpr std::size_t kManyEntries = 512;

  struct Collected {
    std::vector<RecordEntry>
        entries;  // only the first `count` are valid; the others keep their memory for reuse
    std::size_t count = 0;
    std::size_t steps = 0;
  };

  void work();
  void write(const Collected& collected, bool is_last);
  void write(const RecordBatch& batch);

  bus::Writer<RecordBatch>& writer_;
  std::mutex mutex_;
  std::condition_variable wake_;
  Collected collected_;    // under the mutex
  bool is_due_ = false;    // likewise
  bool is_ended_ = false;  // likewise
  std::atomic<bool> is_full_{false};
  std::atomic<std::uint64_t> written_{0};
  std::atomic<std::uint64_t> lost_{0};
  std::atomic<std::size_t> batches_of_step_{1};  // of the largest step so far
  RecordBatches batches_;                        // used by the thread alone
  bool has_given_up_ = false;                    // likewise: a batch was refused after the end
  std::thread thread_;                           // last: it uses the members above
};

}  // namespace sls::sim
