#include "recorder/writing_thread.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "common/app/scheduling.hpp"

namespace sls::record {

WritingThread::WritingThread(Inbox& inbox, const bus::ParticipantDirectory& participants,
                             const sync::Run& run, const Segment& segment)
    : inbox_(inbox),
      participants_(participants),
      run_id_(run.parameters.run_id()),
      recording_(segment, run.parameters),
      last_complete_step_(recording_.last_complete_step()) {
  inbox.open(run_id_, run.server);
  spdlog::info("records run {:016x} of '{}' into {}{}", run_id_, recording_.scenario().name,
               segment.folder.string(),
               segment.first_step > 0 ? fmt::format(", from step {}", segment.first_step) : "");
}

void WritingThread::start() {
  thread_ = std::thread([this] { work(); });
}

WritingThread::~WritingThread() {
  if (!must_close_) {
    RunWatch::End end;
    end.interruption = "the recorder failed";
    close(end);
  }
  if (thread_.joinable()) thread_.join();
}

void WritingThread::close(const RunWatch::End& end) {
  end_ = end;
  must_close_ = true;
}

const RecorderCore::Recorded& WritingThread::recorded() const {
  if (error_) std::rethrow_exception(error_);
  return recorded_;
}

void WritingThread::work() {
  app::put_thread_last();
  try {
    write_samples();
  } catch (...) {  // an exception must not leave the thread
    error_ = std::current_exception();
  }
  has_ended_ = true;
}

void WritingThread::write_samples() {
  for (bool must_close = false; !recording_.has_all() && !must_close;) {
    must_close = must_close_;  // read first: samples that came before it are still written
    const bool has_come = inbox_.empty_into(recording_);
    note_libraries();
    recording_.flush_if_due();
    last_complete_step_ = recording_.last_complete_step();
    if (!recording_.has_all() && !must_close)
      std::this_thread::sleep_for(has_come ? kBusyTime : kWriteTime);
  }
  const RunWatch::End end = must_close_ ? end_ : RunWatch::End();
  recorded_ = recording_.close(end, inbox_.refused());
  last_complete_step_ = recorded_.last_step;
}

void WritingThread::note_libraries() {
  const std::uint64_t version = participants_.version();
  if (std::exchange(participants_version_, version) == version) return;
  for (const auto& entry : participants_.find(ParticipantRole::ROLE_CONTROLLER, run_id_))
    if (entry.announcement.library_sha256().size() > 0)
      recording_.note_library(entry.announcement.name().to_string(),
                              entry.announcement.library_sha256().to_string());
}

}  // namespace sls::record
