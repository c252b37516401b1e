/// The batches of sls/record of a run.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/bus/message_size.hpp"
#include "common/bus/topics.hpp"

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

}  // namespace sls::sim
