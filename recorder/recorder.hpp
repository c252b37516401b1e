/// The recorder: finds the runs to record, one after another, and chooses their folders.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "recorder/run_recorder.hpp"

namespace sls::record {

struct RecorderOptions {
  std::filesystem::path folder;               ///< ready for the first run
  std::optional<OpenedRecording> unfinished;  ///< the recording in `folder` to be continued
  std::uint32_t vehicle = 0;  ///< the run with this vehicle is recorded, with all its vehicles
  bool follow = false;        ///< continue with the run of a server that replaces ours
};

class Recorder {
 public:
  Recorder(bus::Node& node, const RecorderOptions& options);

  /// Records the first run that it finds and, after a reset by an operator, the following runs.
  /// @throws app::RunError if there is no run, or the last recording is not complete.
  void run();

 private:
  std::optional<sync::Run> wait_for_first_run();
  std::optional<sync::Run> find_unfinished_run() const;
  std::optional<sync::Run> wait_for_next_run(const sync::Run& ended, double limit_s);
  std::optional<sync::Run> find_follower(const sync::Run& ended) const;
  std::optional<sync::Run> go_on_after(const sync::Run& run, const RunEnd& end);
  Segment open_segment(const sync::Run& run);

  const RecorderOptions options_;
  const bus::Node& node_;
  bool is_folder_used_ = false;  // true after the first run
  Surroundings surroundings_;
};

}  // namespace sls::record
