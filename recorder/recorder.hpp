/// The recorder over DDS: watches the domain, and does what its core decides. It has two threads in
/// addition to those of the middleware: this one, the main thread, and the one that writes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "recorder/core/recorder_core.hpp"
#include "recorder/inbox.hpp"
#include "recorder/writing_thread.hpp"

namespace sls::record {

struct RecorderOptions {
  std::filesystem::path folder;               ///< ready for the first run
  std::optional<OpenedRecording> unfinished;  ///< the recording in `folder` to be continued
  std::uint32_t vehicle = 0;  ///< the run with this vehicle is recorded, with all its vehicles
  bool follow = false;        ///< continue with the run of a server that replaces ours
};

/// The options of the core, on the machine `host`.
RecorderCore::Options make_core_options(const RecorderOptions& options, const std::string& host);
/// The place of the recording that `core` wants to open.
/// @throws DamagedError if an earlier segment cannot be read.
Segment make_segment(const RecorderOptions& options, const RecorderCore& core);

class Recorder {
 public:
  Recorder(bus::Node& node, const RecorderOptions& options);

  /// Records the first run that it finds and, after a reset by an operator, the following runs.
  /// @throws app::RunError if there is no run, or the last recording is not complete; the error of
  ///   the writing thread, after it has announced the end to the other programs.
  void run();

 private:
  RecorderCore::Act look();
  void act(RecorderCore::Act act);
  RecorderCore::Now look_around() const;
  void open();
  void report();
  void announce();

  const RecorderOptions options_;
  const bus::Node& node_;
  RecorderCore core_;
  bus::ParticipantDirectory participants_;
  bus::ServerDirectory servers_;
  bus::Announcer announcer_;
  Inbox inbox_;
  std::unique_ptr<WritingThread> writing_;  // of the run that is recorded
};

}  // namespace sls::record
