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

#include "common/bus/node.hpp"
#include "common/model/step_record.hpp"
#include "sim_server/record_batches.hpp"

namespace sls::sim {

class RecordStream {
 public:
  /// Number of steps, and time, after which the collected entries are written.
  static constexpr std::size_t kMostSteps = 64;
  static constexpr auto kLongestWait = std::chrono::milliseconds(20);

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
  static constexpr std::size_t kMostCollected = 32'768;

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
