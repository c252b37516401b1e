/// Recordings of the synthetic run on disk, for tests of programs that read recordings.
#pragma once

#include <filesystem>
#include <functional>

#include "recorder/recording.hpp"
#include "tests/recorder/synthetic_run.hpp"

namespace sls::record::test {

/// Numbers batches as a server does, one step in each.
class BatchFeeder {
 public:
  explicit BatchFeeder(Recording& recording, std::uint64_t first_index = 0)
      : recording_(recording), index_(first_index) {}

  void add(const std::vector<RecordEntry>& entries, bool is_last = false) {
    recording_.add(make_batch(index_++, entries, is_last));
  }
  void add_steps(std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t step = from; step <= to; ++step) add({make_entry(step)}, step == kLastStep);
  }

 private:
  Recording& recording_;
  std::uint64_t index_;
};

inline void add_steps(Recording& recording, std::uint64_t from, std::uint64_t to) {
  BatchFeeder(recording, from).add_steps(from, to);
}

/// Adds the final status and finishes the recording.
inline bool finish_flight(Recording& recording) {
  recording.add(make_status(RunPhase::PHASE_FINISHED, kLastStep, "mission finished"));
  return recording.finish("", 0);
}

/// Records the whole synthetic run; `disturb` changes each entry.
inline void record_flight(const std::filesystem::path& folder,
                          const std::function<void(RecordEntry&)>& disturb = {},
                          const Parameters& parameters = make_parameters()) {
  Recording recording(folder, parameters);
  BatchFeeder feeder(recording);
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    RecordEntry entry = make_entry(step);
    if (disturb) disturb(entry);
    feeder.add({entry}, step == kLastStep);
  }
  finish_flight(recording);
}

/// Records the steps until they are flushed, then stops as if killed: it writes no end.
inline void record_until_killed(const Segment& segment, std::uint64_t from, std::uint64_t to) {
  Recording recording(segment, make_parameters());
  add_steps(recording, from, to);
  while (!std::filesystem::exists(segment.folder / "state.csv") ||
         std::filesystem::file_size(segment.folder / "command.csv") < 200)
    recording.flush_if_due();
}

inline Segment make_segment(const std::filesystem::path& folder) {
  Segment segment;
  segment.folder = folder;
  return segment;
}

}  // namespace sls::record::test
