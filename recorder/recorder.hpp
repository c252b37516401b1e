/// The recorder: listens to every topic of one run and keeps it on disk. Two threads beside the
/// middleware's: the main one watches the run and announces progress; the other one writes, because
/// a slow disk must not delay the watching.
#pragma once

#include <atomic>
#include <chrono>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "common/app/mailbox.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"

namespace sls::record {

class Recorder {
 public:
  /// Will record the first run it finds into `folder`, which is ready for it.
  Recorder(bus::Node& node, const std::filesystem::path& folder);

  /// Runs from joining to the end of the recording.
  /// @throws app::RunError if there is no run, or the recording is not complete.
  void run();

 private:
  using Clock = std::chrono::steady_clock;
  using Sample = std::variant<VehicleState, ControlCommand, Reference, SimStatus>;

  void join_run();
  void watch();
  bool sees_all_endpoints() const;
  void announce(bool done);
  void write_samples();  // the writing thread

  const std::filesystem::path folder_;
  std::optional<bus::Run> run_;
  config::Scenario scenario_;
  bool ready_ = false;
  std::int64_t announced_step_ = -1;

  // Shared with the writing thread.
  app::Mailbox<Sample> samples_;
  std::atomic<bool> stop_writing_{false};
  std::atomic<bool> has_all_{false};
  std::atomic<std::int64_t> last_complete_step_{-1};
  std::string interruption_;          // set before stop_writing_
  std::string gaps_;                  // read after the thread has ended
  std::exception_ptr writing_error_;  // likewise
  std::atomic<bool> writing_failed_{false};

  bus::ParticipantDirectory participants_;
  bus::ServerDirectory servers_;
  bus::Writer<Participant> participant_writer_;
  bus::Reader<VehicleState> state_reader_;
  bus::Reader<ControlCommand> command_reader_;
  bus::Reader<Reference> reference_reader_;
};

}  // namespace sls::record
