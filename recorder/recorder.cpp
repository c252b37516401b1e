#include "recorder/recorder.hpp"

#include <spdlog/spdlog.h>

#include <csignal>
#include <thread>

#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/wait.hpp"
#include "recorder/recording.hpp"

namespace sls::record {
namespace {

using namespace std::chrono_literals;

constexpr auto kUsualJoinTime = 3s;        // a server's claim and discovery: no news
constexpr auto kPollTime = 20ms;           // between two looks at the run
constexpr auto kWriteTime = 5ms;           // between two batches of the writing thread
constexpr double kJoinTimeout = 60;        // until a run must be found
constexpr auto kCompletionTime = 10s;      // for what is missing after the end of a finished run
constexpr auto kFailedTime = 1s;           // likewise of a failed one
constexpr auto kInterruptionTime = 500ms;  // likewise after a stop signal
constexpr std::size_t kMailboxSize = 65536;

}  // namespace

Recorder::Recorder(bus::Node& node, const std::filesystem::path& folder)
    : folder_(folder),
      samples_(kMailboxSize),
      participants_(node),
      servers_(node, [this](const SimStatus& status) { samples_.put(status); }),
      participant_writer_(node),
      state_reader_(
          node, bus::kRecorderReaderProfile,
          [this](const VehicleState& sample, const bus::PeerId&) { samples_.put(sample); }),
      command_reader_(
          node, bus::kRecorderReaderProfile,
          [this](const ControlCommand& sample, const bus::PeerId&) { samples_.put(sample); }),
      reference_reader_(
          node, bus::kRecorderReaderProfile,
          [this](const Reference& sample, const bus::PeerId&) { samples_.put(sample); }) {}

void Recorder::run() {
  join_run();
  if (!run_) return;  // interrupted
  std::thread writing([this] { write_samples(); });
  std::exception_ptr watching_error;  // kept until the thread has closed its files
  try {
    watch();
  } catch (...) {
    watching_error = std::current_exception();
    interruption_ = "the recorder failed";
  }
  stop_writing_ = true;
  writing.join();
  if (watching_error) std::rethrow_exception(watching_error);
  announce(true);
  // The others wait for this announcement before they leave; it must reach them before we do.
  participant_writer_.wait_for_acknowledgments(1s);
  if (writing_error_) std::rethrow_exception(writing_error_);
  if (!gaps_.empty()) throw app::RunError(folder_.string() + ": not complete: " + gaps_);
  spdlog::info("{}: complete, {} steps", folder_.string(), last_complete_step_.load());
}

void Recorder::join_run() {
  announce(false);
  app::Wait wait(kJoinTimeout, kUsualJoinTime);
  while (!(run_ = servers_.find_joinable(0)) && app::stop_signal() == 0) {
    if (wait.is_over())
      throw app::RunError(fmt::format("{}: nothing recorded: no server within {} s",
                                      folder_.string(), kJoinTimeout));
    if (wait.is_report_due())
      spdlog::info("waiting for: server ({:.0f} s left)", wait.seconds_left());
    std::this_thread::sleep_for(kPollTime);
  }
  if (!run_) return;
  const Parameters& parameters = run_->parameters;
  scenario_ = config::parse_scenario(parameters.scenario_text().to_string(), "sls/parameters");
  spdlog::info("records run {:016x} of '{}' into {}", parameters.run_id(), scenario_.name,
               folder_.string());
  announce(false);
}

bool Recorder::sees_all_endpoints() const {
  if (state_reader_.matched().count(run_->server) == 0) return false;
  const auto command_writers = command_reader_.matched();
  const auto reference_writers = reference_reader_.matched();
  int controllers = 0;
  for (const auto& entry : participants_.find(ROLE_CONTROLLER, run_->parameters.run_id()))
    if (command_writers.count(entry.peer) > 0 && reference_writers.count(entry.peer) > 0)
      ++controllers;
  return controllers >= scenario_.sync.wait_for.controllers;
}

void Recorder::watch() {
  std::optional<Clock::time_point> give_up;
  const auto end_by = [&](std::chrono::milliseconds limit) {
    if (!give_up) give_up = Clock::now() + limit;
  };
  while (!has_all_ && !writing_failed_) {
    const auto status = servers_.find_status(run_->parameters.run_id());
    if (app::stop_signal() != 0) {
      interruption_ =
          app::stop_signal() == SIGINT ? "interrupted by SIGINT" : "interrupted by SIGTERM";
      end_by(kInterruptionTime);
    } else if (status && status->phase() == PHASE_FINISHED) {
      end_by(kCompletionTime);
    } else if (status && status->phase() == PHASE_FAILED) {
      end_by(kFailedTime);
    } else if (!servers_.is_present(run_->server)) {
      interruption_ = "the server is gone";
      end_by(kFailedTime);
    }
    if (give_up && Clock::now() >= *give_up) return;

    if (!ready_ && sees_all_endpoints()) {
      ready_ = true;
      announce(false);
    } else if (last_complete_step_ != announced_step_) {
      announce(false);
    }
    std::this_thread::sleep_for(kPollTime);
  }
}

void Recorder::announce(bool done) {
  Participant message;
  message.run_id(run_ ? run_->parameters.run_id() : 0);
  message.role(ROLE_RECORDER);
  message.name("recorder");
  message.host(bus::host_name());
  if (run_) message.scenario_sha256(run_->parameters.scenario_sha256());
  message.ready(ready_ && !writing_failed_);
  message.done(done);
  message.last_complete_step(announced_step_ = last_complete_step_);
  participant_writer_.write(message);
}

void Recorder::write_samples() {
  try {
    Recording recording(folder_, run_->parameters);
    bool is_stopped = false;
    while (!recording.has_all() && !is_stopped) {
      is_stopped = stop_writing_;  // what is there by now is still taken
      for (const Sample& sample : samples_.take_all())
        std::visit([&](const auto& message) { recording.add(message); }, sample);
      recording.flush_if_due();
      last_complete_step_ = recording.last_complete_step();
      std::this_thread::sleep_for(kWriteTime);
    }
    const std::string interruption = recording.has_all() ? "" : interruption_;
    if (!recording.finish(interruption, samples_.refused())) gaps_ = recording.describe_gaps();
    last_complete_step_ = recording.last_complete_step();
    has_all_ = true;
  } catch (...) {
    writing_error_ = std::current_exception();
    writing_failed_ = true;
  }
}

}  // namespace sls::record
