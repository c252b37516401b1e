/// Recordings of the synthetic run on disk, for tests of what reads them.
#pragma once

#include <filesystem>
#include <functional>

#include "recorder/recording.hpp"
#include "tests/recorder/synthetic_run.hpp"

namespace sls::record::test {

inline void add_step(Recording& recording, std::uint64_t step) {
  recording.add(make_state(step));
  recording.add(make_command(step));
  recording.add(make_reference(step));
}

inline void add_steps(Recording& recording, std::uint64_t from, std::uint64_t to) {
  for (std::uint64_t step = from; step <= to; ++step) add_step(recording, step);
}

/// The last step, the final status and the end of the recording.
inline bool finish_flight(Recording& recording) {
  recording.add(make_status(PHASE_FINISHED, kLastStep, "mission finished"));
  return recording.finish("", 0);
}

/// The whole synthetic run, each state changed by `disturb`.
inline void record_flight(
    const std::filesystem::path& folder,
    const std::function<void(VehicleState&, ControlCommand&, Reference&)>& disturb = {}) {
  Recording recording(folder, make_parameters());
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    VehicleState state = make_state(step);
    ControlCommand command = make_command(step);
    Reference reference = make_reference(step);
    if (disturb) disturb(state, command, reference);
    recording.add(state);
    recording.add(command);
    recording.add(reference);
  }
  finish_flight(recording);
}

/// Runs until flushed, then is killed: nothing of its end is written.
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
