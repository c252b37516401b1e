/// Which runs are recorded, where their recordings go and how the recorder ends: it finds a run,
/// watches it until its recording is closed, and goes on after a reset. No network, thread, file or
/// clock here: the shell (recorder/recorder.hpp) looks every few milliseconds and does what comes
/// out.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/sync/line.hpp"
#include "common/sync/patience.hpp"
#include "common/sync/servers.hpp"
#include "recorder/core/run_watch.hpp"

namespace sls::record {

class RecorderCore {
 public:
  /// A recording to be continued.
  struct Unfinished {
    std::string run_id;
    std::string outcome;
    std::vector<std::uint32_t> vehicle_ids;
  };
  struct Options {
    std::string folder;    ///< for messages
    Participant identity;  ///< the constant part of every announcement
    /// Records the run of this vehicle; ignored if the resumed recording lacks it.
    std::uint32_t vehicle = 0;
    bool follows_servers = false;  ///< continue with the run of a server that replaces ours
    std::optional<Unfinished> unfinished;
    /// True if a further run has a subfolder already.
    std::function<bool(std::uint64_t run_id)> has_subfolder = [](std::uint64_t) { return false; };
  };
  /// The knowledge of the shell at a look.
  struct Now : RunWatch::Now {
    bool is_closed = false;  ///< the writing of the run has ended
  };
  enum class Phase {
    kFinding,    ///< a run to record, the first or the next one
    kOpening,    ///< until on_opened
    kRecording,  ///< the run is flown, or samples are waited for
    kClosing,    ///< the rest is written
    kClosed,     ///< until on_recorded
    kEnded,
  };
  enum class Act {
    kNone,
    kOpen,      ///< begin to record run() in place(), then call on_opened
    kAnnounce,  ///< the progress
    kClose,     ///< write the rest, without further samples: watch_end()
    kReport,    ///< announce that the recorder is done with the run, then call on_recorded
  };
  enum class Place {
    kFolder,       ///< the folder of the recordings itself
    kNextSegment,  ///< the next segment of the recording in it
    kSubfolder,    ///< of the run; perhaps the next segment of a recording in that
  };
  /// A recording that is closed.
  struct Recorded {
    bool is_complete = false;
    bool is_reset = false;  ///< the run was reset by an operator
    std::string gaps;       ///< why it is not complete, in one line
    std::int64_t last_step = -1;
  };

  /// Begins to look for a run with the first look.
  explicit RecorderCore(Options options);

  Act look(const sync::Servers& servers, const Now& now);
  /// When the next look is due.
  sync::Time next_deadline() const { return deadline_; }
  /// The recording is open and announced, `now`; its server is lost after `server_deadline_s`.
  void on_opened(double server_deadline_s, const RunWatch::Now& now);
  void on_recorded(const Recorded& recorded, const std::string& interruption);

  Phase phase() const { return phase_; }
  std::uint32_t vehicle() const { return vehicle_; }
  /// The run that is recorded; empty before the first.
  const std::optional<sync::Run>& run() const { return run_; }
  Place place() const { return place_; }
  /// The recorder hears the server of its run.
  bool is_ready() const { return watch_ && watch_->is_ready(); }
  /// The announcement for the present phase. `last_complete_step`: of the recording; −1: none.
  /// `has_failed`: it cannot be written.
  Participant make_announcement(std::int64_t last_complete_step, bool has_failed) const;
  /// Why the recording is closed.
  const RunWatch::End& watch_end() const { return watch_->end(); }
  /// Why the recorder ends; empty if there is nothing wrong.
  const std::string& error() const { return error_; }
  std::vector<sync::Line> take_lines() { return std::exchange(lines_, {}); }

 private:
  Act find(const sync::Servers& servers, const Now& now);
  std::optional<sync::Run> find_run(const sync::Servers& servers, sync::Time now) const;
  std::optional<sync::Run> find_first_run(const sync::Servers& servers, sync::Time now) const;
  Act open(const sync::Run& run);
  std::optional<Place> choose_place(std::uint64_t run_id) const;
  Act watch(const sync::Servers& servers, const Now& now);
  Act end(std::string error = {});

  const Options options_;
  const std::uint32_t vehicle_;
  Phase phase_ = Phase::kFinding;
  sync::Time deadline_;
  double limit_s_;                          // of finding a run
  std::optional<sync::Patience> patience_;  // likewise
  std::optional<sync::Run> run_;
  Place place_ = Place::kFolder;
  std::optional<RunWatch> watch_;  // of the run
  std::string error_;
  std::vector<sync::Line> lines_;
};

}  // namespace sls::record
