#include "tools/view/replay/shown_recording.hpp"

#include <spdlog/fmt/fmt.h>

#include <utility>

#include "common/config/config_error.hpp"
#include "recorder/recording_reader.hpp"
#include "tools/view/replay/recorded_run.hpp"

namespace sls::view {
namespace {

namespace fs = std::filesystem;

/// `folder`, or a folder in it. @throws config::ConfigError if none is the recording of the run.
fs::path find_recording(const fs::path& folder, std::uint64_t run_id) {
  const std::string id = fmt::format("{:016x}", run_id);
  std::vector<fs::path> places{folder};
  std::error_code error;
  for (fs::directory_iterator i(folder, error), end; !error && i != end; i.increment(error))
    places.push_back(i->path());
  const std::string problem = error ? error.message() : "got none";
  for (const fs::path& place : places) {
    if (!fs::exists(place / "manifest.json", error)) continue;
    try {
      if (record::read_manifest(place).run_id == id) return place;
    } catch (const config::ConfigError&) {  // one of many
    }
  }
  throw config::ConfigError(folder.string() + ": expected the recording of run " + id + ", " +
                            problem);
}

}  // namespace

ShownRecording::~ShownRecording() {
  *is_alive_ = false;
  is_ending_ = true;
  if (thread_.joinable()) thread_.join();
}

void ShownRecording::ask(std::uint64_t run_id, bool is_over, Done done) {
  run_id_ = run_id;
  is_over_ = is_over;
  waiting_.push_back(std::move(done));
  if (!thread_.joinable()) read_next();
}

/// Answers all that wait, by one reading that begins after they have asked.
void ShownRecording::read_next() {
  const auto all = std::exchange(waiting_, {});
  const auto answer_all = [is_alive = is_alive_, all](
                              bool is_there, const std::shared_ptr<const std::string>& answer) {
    for (const Done& done : all)
      if (*is_alive) done(is_there, answer);
  };
  const auto work = [this, answer_all, is_alive = is_alive_, run_id = run_id_, is_over = is_over_] {
    std::string bytes;
    bool is_there = true;
    try {
      bytes = read(run_id, is_over);
    } catch (const std::exception& error) {  // must not leave the thread; the pages show it
      bytes = error.what();
      is_there = false;
    }
    post_([this, is_alive, answer_all, is_there,
           answer = std::make_shared<const std::string>(std::move(bytes))] {
      if (!*is_alive) return;
      thread_.join();
      newest_ = answer;
      answer_all(is_there, answer);
      if (!waiting_.empty()) read_next();
    });
  };
  try {
    thread_ = std::thread(work);
  } catch (const std::system_error& error) {  // a limit of threads
    const std::string text =
        fmt::format("expected a thread to read it, got none: {}", error.what());
    post_([answer_all, answer = std::make_shared<const std::string>(text)] {
      answer_all(false, answer);
    });
  }
}

std::string ShownRecording::read(std::uint64_t run_id, bool is_over) const {
  const fs::path folder = find_recording(folder_, run_id);
  for (int looks = 0; is_over && looks < 250 && !is_ending_ &&
                      record::open_recording(folder).manifest().outcome == "recording";
       ++looks)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return load_recorded_run(folder, kMostServedBytes, folder.string(),
                           [this] { return is_ending_.load(); });
}

}  // namespace sls::view
