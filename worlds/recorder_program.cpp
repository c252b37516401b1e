#include "worlds/recorder_program.hpp"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>
#include <variant>

namespace sls::worlds {

using namespace std::chrono_literals;

RecorderProgram::RecorderProgram(Setting& setting, Host& host, std::string name,
                                 const Options& options)
    : Program(setting, host, Role::kRecorder, std::move(name)),
      options_(options),
      arrivals_(
          [this](std::uint64_t run_id) {
            return present_servers().may_fly(run_id, core_->vehicle());
          },
          options.queue),
      disk_(setting.seed) {}

void RecorderProgram::start() {
  recorder_options_.folder =
      options_.folder.empty() ? std::filesystem::path(name()) : options_.folder;
  recorder_options_.vehicle = options_.vehicle;
  recorder_options_.follow = options_.follows_servers;
  try {  // as the program's main
    if (options_.resumes && !options_.folder.empty())
      recorder_options_.unfinished = record::find_unfinished_recording(options_.folder);
    else if (!options_.folder.empty())
      record::prepare_recording_folder(options_.folder, false);
  } catch (const config::ConfigError& error) {
    return exit(2, error.what());
  } catch (const record::DamagedError& error) {  // by a power cut
    return exit(1, error.what());
  }
  core_ = std::make_unique<record::RecorderCore>(
      record::make_core_options(recorder_options_, process_.host().name()));
  read<Participant>();
  read<Parameters>();
  peer_.add_writer<Participant>();
  peer_.add_reader<RecordBatch>([this](const RecordBatch& batch, const Peer::Arrival& arrival) {
    arrivals_.put({batch.run_id(), arrival.sender, batch});
  });
  peer_.add_reader<SimStatus>([this](const SimStatus& status, const Peer::Arrival& arrival) {
    note(status, arrival);
    arrivals_.put({status.run_id(), arrival.sender, status});
  });
  setting_.network.announce(peer_);
  announce_progress();
  wake_soon();
}

// --- the main thread -----------------------------------------------------------------------------

void RecorderProgram::wake() {
  if (acknowledged_by_) {
    if (!is_heard() && now() < *acknowledged_by_) return wake_at(now() + 1ms);
    acknowledged_by_.reset();
    if (!failure_.empty()) return exit(1, failure_);
    core_->on_recorded(recorded_, stop_signal_);
    writing_.reset();
  }
  act(core_->look(present_servers(), look_around()));
  for (const sync::Line& line : core_->take_lines()) say(line);
  if (acknowledged_by_) return wake_at(now() + 1ms);
  repeat_announcement_if_due();
  if (core_->phase() == record::RecorderCore::Phase::kEnded) {
    // As app::run_main: the signal is the exit code, also of a recorder that has reported the gaps.
    if (was_interrupted() && core_->error().empty() && !is_complete())
      return exit(130, stop_signal_);
    return exit(core_->error().empty() ? 0 : 1, core_->error());
  }
  wake_at(core_->next_deadline());
}

void RecorderProgram::act(record::RecorderCore::Act act) {
  using Act = record::RecorderCore::Act;
  if (act == Act::kOpen) open();
  if (act == Act::kAnnounce) announce_progress();
  if (act == Act::kClose) must_close_ = core_->watch_end();
  if (act == Act::kReport) report();
}

record::RecorderCore::Now RecorderProgram::look_around() {
  record::RecorderCore::Now seen;
  seen.time = now();
  seen.interruption = stop_signal_;
  if (!writing_) return seen;
  seen.is_closed = has_closed_;
  seen.hears_server = sees(core_->run()->server);
  seen.last_complete_step = writing_->last_complete_step();
  return seen;
}

void RecorderProgram::open() {
  const sync::Run& run = *core_->run();
  const config::Scenario& scenario = setting_.flown->scenario;
  must_close_.reset();
  has_closed_ = false;
  recorded_ = {};
  if (options_.folder.empty()) {
    StoredRecording& stored = recordings_.emplace_back();
    stored.run_id = run.parameters.run_id();
    writing_ =
        std::make_unique<MemoryRecording>(stored, run.parameters, scenario.record.flush_s, now(),
                                          is_disk_full_, [this](const auto& line) { say(line); });
  } else {
    try {
      record::Segment segment = record::make_segment(recorder_options_, *core_);
      segment.write = [this](int descriptor, const void* bytes, std::size_t size) {
        return write_to_disk(descriptor, bytes, size);
      };
      writing_ = std::make_unique<FileRecording>(segment, run.parameters, now());
    } catch (const record::DamagedError& error) {
      return exit(1, error.what());
    } catch (const std::system_error& error) {
      return exit(1, error.what());
    }
  }
  has_recorded_ = true;
  first_progress_ = writing_->last_complete_step();
  newest_.clear();
  for (const std::uint32_t id : sync::list_vehicle_ids(run.parameters)) newest_[id] = -1;
  arrivals_.open(run.parameters.run_id(), run.server);
  say(fmt::format("records run {:016x}", run.parameters.run_id()));
  announce_progress();
  core_->on_opened(scenario.sync.wait.server_deadline_s, look_around());
  process_.run_at(setting_.timeline.now(), [this] { write(); });
}

/// The last announcement must reach the others, who wait for it: the main thread waits, too.
void RecorderProgram::report() {
  announce_progress();
  acknowledged_by_ = now() + 3s;
}

/// All have the last announcement, above all the server.
bool RecorderProgram::is_heard() const {
  const bus::PeerId& server = core_->run()->server;
  return (!sees(server) || peer_.matched_readers(TopicId::kParticipant).count(server) > 0) &&
         peer_.is_acknowledged(TopicId::kParticipant);
}

void RecorderProgram::announce_progress() {
  const std::int64_t progress = writing_ ? writing_->last_complete_step() : -1;
  if (progress > first_progress_) setting_.properties.on_progress(*this, progress, newest_);
  announce(core_->make_announcement(progress, !failure_.empty()));
}

// --- the writing thread --------------------------------------------------------------------------

void RecorderProgram::write() {
  if (!writing_ || has_closed_) return;
  try {
    const bool has_come = write_samples();
    if (has_closed_) return;
    process_.run_at(
        setting_.timeline.now() + options_.disk_delay +
            (has_come ? record::WritingThread::kBusyTime : record::WritingThread::kWriteTime),
        [this] { write(); });
  } catch (const std::system_error& error) {
    failure_ = error.what();
    has_closed_ = true;
  }
}

ssize_t RecorderProgram::write_to_disk(int descriptor, const void* bytes, std::size_t size) {
  const bool is_short = size > 1 && disk_.chance(0.2);
  if (is_disk_full_ && !is_short) {
    errno = ENOSPC;
    return -1;
  }
  return ::write(descriptor, bytes, is_short ? 1 + disk_.index(size - 1) : size);
}

void RecorderProgram::note_newest(const RecordBatch& batch) {
  for (const RecordEntry& entry : batch.entries()) {
    const auto newest = newest_.find(entry.vehicle_id());
    if (newest != newest_.end())
      newest->second = std::max(newest->second, static_cast<std::int64_t>(entry.step()));
  }
}

/// True if there were samples.
bool RecorderProgram::write_samples() {
  const bool must_close = must_close_.has_value();
  bool has_come = false;
  for (const record::Arrivals::Sample& sample : arrivals_.take_all()) {
    has_come = true;
    if (const auto* batch = std::get_if<RecordBatch>(&sample)) {
      note_newest(*batch);
      writing_->add(*batch, now());
    } else {
      const auto& status = std::get<SimStatus>(sample);
      writing_->add(status);
      if (options_.folder.empty() && status.run_id() == recordings_.back().run_id) {
        recordings_.back().statuses.insert(status.sample_index());
        recordings_.back().status = status;
      }
    }
  }
  writing_->on_time(now());
  if (writing_->is_whole() || must_close) {
    recorded_ = writing_->close(must_close_.value_or(record::RunWatch::End()), arrivals_.refused());
    has_closed_ = true;
  }
  return has_come;
}

}  // namespace sls::worlds
