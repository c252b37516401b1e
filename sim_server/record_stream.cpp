#include "sim_server/record_stream.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "common/bus/convert.hpp"

namespace sls::sim {

RecordStream::RecordStream(bus::Writer<RecordBatch>& writer, std::size_t max_bytes,
                           std::uint64_t run_id)
    : writer_(writer), batches_(max_bytes, run_id), thread_([this] { work(); }) {}

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
  return static_cast<std::uint64_t>(writer_.history_depth()) / batches_of_step_;
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
  batches_.make(collected.entries.data(), collected.count, is_last,
                [this](const RecordBatch& batch) { write(batch); });
  batches_of_step_ = batches_.batches_of_step();
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
