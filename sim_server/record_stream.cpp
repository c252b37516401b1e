#include "sim_server/record_stream.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "common/bus/convert.hpp"
#include "common/bus/message_size.hpp"

namespace sls::sim {

RecordStream::RecordStream(bus::Writer<RecordBatch>& writer, std::size_t max_bytes,
                           std::uint64_t run_id)
    : writer_(writer), max_bytes_(max_bytes), run_id_(run_id), thread_([this] { work(); }) {}

void RecordStream::add_step(const std::vector<model::StepRecord>& records) {
  bool is_due = false;
  {
    const std::lock_guard lock(mutex_);
    if (collected_.count + records.size() > kMostCollected || is_ended_) {
      lost_ += records.size();
      return;
    }
    if (collected_.entries.size() < collected_.count + records.size())
      collected_.entries.resize(collected_.count + records.size());
    for (const model::StepRecord& record : records)
      bus::fill(collected_.entries[collected_.count++], record);
    is_due = ++collected_.steps == kMostSteps || collected_.count >= kManyEntries;
    is_due_ = is_due_ || is_due;
    if (collected_.count > kMostCollected / 2) is_full_ = true;
  }
  if (is_due) wake_.notify_one();
}

void RecordStream::flush() {
  {
    const std::lock_guard lock(mutex_);
    is_due_ = true;
  }
  wake_.notify_one();
}

void RecordStream::end() {
  {
    const std::lock_guard lock(mutex_);
    is_ended_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

std::uint64_t RecordStream::history_steps() const {
  const std::size_t batches_of_step = step_bytes_ / max_bytes_ + 1;
  return static_cast<std::uint64_t>(writer_.history_depth()) / batches_of_step;
}

void RecordStream::work() {
  Collected writing;
  bool is_last = false;
  while (!is_last) {
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, kLongestWait, [this] { return is_due_ || is_ended_; });
      std::swap(writing, collected_);
      is_due_ = false;
      is_last = is_ended_;
      is_full_ = false;
    }
    write(writing, is_last);
    writing.count = writing.steps = 0;
  }
  if (has_given_up_)
    spdlog::warn("sls/record: the run has ended, {} entries were not published", lost_.load());
}

void RecordStream::write(const Collected& collected, bool is_last) {
  const std::size_t header = bus::calc_size(batch_);
  std::size_t bytes = header;
  for (std::size_t i = 0; i < collected.count; ++i) {
    const RecordEntry& entry = collected.entries[i];
    std::size_t more = bus::calc_size(entry, bytes);
    if (entry.step() != step_) bytes_of_step_ = 0;
    step_ = entry.step();
    bytes_of_step_ += more;
    step_bytes_ = std::max<std::size_t>(step_bytes_, bytes_of_step_);
    const bool is_full = bytes + more > max_bytes_ || batch_.entries().size() == BATCH_ENTRIES;
    if (is_full && !batch_.entries().empty()) {
      write_batch(false);
      bytes = header;
      more = bus::calc_size(entry, bytes);
    }
    batch_.entries().push_back(entry);
    bytes += more;
  }
  if (!batch_.entries().empty() || is_last) write_batch(is_last);
}

void RecordStream::write_batch(bool is_last) {
  batch_.run_id(run_id_);
  batch_.batch_index(next_batch_++);
  batch_.is_last(is_last);
  try {
    if (!has_given_up_) writer_.write(batch_);
    (has_given_up_ ? lost_ : written_) += batch_.entries().size();
  } catch (const bus::BusError& error) {
    lost_ += batch_.entries().size();
    spdlog::warn("{}", error.what());
    const std::lock_guard lock(mutex_);
    has_given_up_ = is_ended_;  // each further batch would block as long
  }
  batch_.entries().clear();
}

}  // namespace sls::sim
