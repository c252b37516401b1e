#include "sim_server/record_stream.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "common/bus/convert.hpp"

namespace sls::sim {

// --- RecordBatches -------------------------------------------------------------------------------

void RecordBatches::add(const model::StepRecord& record) {
  if (used_ == 0) begin_batch();
  RecordEntry* entry = &next_entry();
  bus::fill(*entry, record);
  std::size_t more = bus::calc_size(*entry, bytes_);
  note_size(record.step, more);
  const std::size_t entries = batches_[used_ - 1].entries;
  if (entries > 0 && (bytes_ + more > max_bytes_ || entries == BATCH_ENTRIES)) {
    RecordEntry moved = std::move(*entry);
    begin_batch();
    entry = &next_entry();
    *entry = std::move(moved);
    more = bus::calc_size(*entry, bytes_);
  }
  ++batches_[used_ - 1].entries;
  bytes_ += more;
  ++count_;
}

void RecordBatches::begin_batch() {
  if (used_ == batches_.size()) batches_.emplace_back().message.run_id(run_id_);
  batches_[used_++].entries = 0;
  bytes_ = bus::calc_size(RecordBatch());
}

/// The entry after the last of the last batch, with any content.
RecordEntry& RecordBatches::next_entry() {
  auto& [batch, entries] = batches_[used_ - 1];
  if (batch.entries().size() == entries) batch.entries().emplace_back();
  return batch.entries()[entries];
}

void RecordBatches::note_size(std::uint64_t step, std::size_t bytes) {
  bytes_of_step_ = step == step_ ? bytes_of_step_ + bytes : bytes;
  step_ = step;
  step_bytes_ = std::max(step_bytes_, bytes_of_step_);
}

// --- RecordStream --------------------------------------------------------------------------------

RecordStream::RecordStream(bus::Writer<RecordBatch>& writer, std::size_t max_bytes,
                           std::uint64_t run_id)
    : writer_(writer),
      collected_(max_bytes, run_id),
      writing_(max_bytes, run_id),
      thread_([this] { work(); }) {}

void RecordStream::add_step(const std::vector<model::StepRecord>& records) {
  bool is_due = false;
  {
    const std::lock_guard lock(mutex_);
    if (collected_.count() + records.size() > kMostCollected || is_ended_) {
      lost_ += records.size();
      return;
    }
    for (const model::StepRecord& record : records) collected_.add(record);
    is_due = ++steps_ == kMostSteps || collected_.count() >= kManyEntries;
    is_due_ = is_due_ || is_due;
    if (collected_.count() > kMostCollected / 2) is_full_ = true;
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
  return static_cast<std::uint64_t>(writer_.history_depth()) / batches_of_step_;
}

void RecordStream::work() {
  bool is_last = false;
  while (!is_last) {
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, kLongestWait, [this] { return is_due_ || is_ended_; });
      std::swap(writing_, collected_);
      steps_ = 0;
      is_due_ = false;
      is_last = is_ended_;
      is_full_ = false;
    }
    writing_.write(next_batch_, is_last, [this](const RecordBatch& batch) { write(batch); });
    writing_.clear();
    batches_of_step_ = std::max<std::size_t>(batches_of_step_, writing_.batches_of_step());
  }
  if (has_given_up_)
    spdlog::warn("sls/record: the run has ended, {} entries were not published", lost_.load());
}

void RecordStream::write(const RecordBatch& batch) {
  try {
    if (!has_given_up_) writer_.write(batch);
    (has_given_up_ ? lost_ : written_) += batch.entries().size();
  } catch (const bus::BusError& error) {
    lost_ += batch.entries().size();
    spdlog::warn("{}", error.what());
    const std::lock_guard lock(mutex_);
    has_given_up_ = is_ended_;  // each further batch would block as long
  }
}

}  // namespace sls::sim
