#include "recorder/recorder.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/wait.hpp"

namespace sls::record {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr double kJoinTimeout = 60;  // until a run must be found, s

/// Calls `find` until it returns a run, a stop signal comes or `limit_s` is over.
template <class Find>
std::optional<sync::Run> wait_for_run(const bus::Node& node, bus::Announcer& announcer,
                                      const std::string& whom, double limit_s, Find find) {
  app::Wait wait(limit_s, sync::kUsualJoinTime);
  while (app::stop_signal() == 0 && !wait.is_over()) {
    if (auto run = find()) return run;
    announcer.repeat_if_due();
    if (wait.is_report_due())
      spdlog::info("waiting for: {} ({:.0f} s left){}", whom, wait.seconds_left(),
                   node.describe_isolation());
    std::this_thread::sleep_for(app::kShortPollTime);
  }
  return std::nullopt;
}

std::string to_text(std::uint64_t run_id) { return fmt::format("{:016x}", run_id); }

/// The vehicle of the options; if a recording to be continued does not have it, its first vehicle.
std::uint32_t choose_vehicle(const RecorderOptions& options) {
  const auto ids = options.unfinished ? options.unfinished->vehicle_ids()
                                      : std::vector<std::uint32_t>{options.vehicle};
  const bool is_among = std::find(ids.begin(), ids.end(), options.vehicle) != ids.end();
  return is_among || ids.empty() ? options.vehicle : ids.front();
}

}  // namespace

Recorder::Recorder(bus::Node& node, const RecorderOptions& options)
    : options_(options), node_(node), surroundings_(node, choose_vehicle(options)) {}

void Recorder::run() {
  surroundings_.announcer.announce(make_announcement(nullptr, false, false, -1));
  auto run = wait_for_first_run();
  if (!run && app::stop_signal() == 0)
    throw app::RunError(fmt::format("{}: nothing recorded: no server within {} s{}",
                                    options_.folder.string(), kJoinTimeout,
                                    node_.describe_isolation()));
  while (run) {
    RunEnd end;
    try {
      end = RunRecorder(surroundings_, *run, open_segment(*run)).run();
    } catch (...) {
      surroundings_.announcer.wait_for_acknowledgments(1s);
      throw;
    }
    // Other programs wait for the last announcement of this recorder before they end, so it must
    // reach them.
    surroundings_.announcer.wait_for_acknowledgments(1s);
    run = go_on_after(*run, end);
  }
}

// --- which run -----------------------------------------------------------------------------------

std::optional<sync::Run> Recorder::wait_for_first_run() {
  const std::string whom =
      options_.unfinished ? "server of run " + options_.unfinished->manifest().run_id : "server";
  return wait_for_run(node_, surroundings_.announcer, whom, kJoinTimeout, [this] {
    const auto unfinished = find_unfinished_run();
    return unfinished ? unfinished : surroundings_.servers.find_joinable(surroundings_.vehicle);
  });
}

/// The run of the unfinished recording, even if it has just ended.
std::optional<sync::Run> Recorder::find_unfinished_run() const {
  if (!options_.unfinished) return std::nullopt;
  for (const sync::Run& run : surroundings_.servers.runs()) {
    const std::uint64_t id = run.parameters.run_id();
    if (to_text(id) == options_.unfinished->manifest().run_id ||
        fs::exists(options_.folder / name_run(id)))
      return run;
  }
  return std::nullopt;
}

std::optional<sync::Run> Recorder::go_on_after(const sync::Run& run, const RunEnd& end) {
  const std::string place = options_.folder.string();
  if (end.is_complete) {
    spdlog::info("{}: complete, {} steps", place, end.last_step);
    return std::nullopt;
  }
  if (app::stop_signal() == 0 && end.replacement && options_.follow) {
    spdlog::warn("{}: not complete: {}", place, end.gaps);
    return end.replacement;
  }
  if (app::stop_signal() != 0 || !end.is_reset)
    throw app::RunError(fmt::format("{}: not complete: {}", place, end.gaps));

  const std::string id = to_text(run.parameters.run_id());
  spdlog::info("{}: run {} ended by a reset: {}", place, id, end.gaps);
  const auto scenario =
      config::parse_scenario(run.parameters.scenario_text().to_string(), "sls/parameters");
  const double limit_s = scenario.sync.wait.server_deadline_s;
  const auto next = wait_for_next_run(run, limit_s);
  if (!next && app::stop_signal() == 0)
    throw app::RunError(
        fmt::format("{}: no run within {} s of the reset of run {}", place, limit_s, id));
  return next;
}

std::optional<sync::Run> Recorder::wait_for_next_run(const sync::Run& ended, double limit_s) {
  return wait_for_run(node_, surroundings_.announcer,
                      "the run after the reset of run " + to_text(ended.parameters.run_id()),
                      limit_s, [&] { return find_follower(ended); });
}

std::optional<sync::Run> Recorder::find_follower(const sync::Run& ended) const {
  auto next = surroundings_.servers.find_successor(ended, {surroundings_.vehicle});
  if (next && !(next->server == ended.server) && !options_.follow) return std::nullopt;
  return next;
}

// --- where it goes -------------------------------------------------------------------------------

Segment Recorder::open_segment(const sync::Run& run) {
  const std::string id = to_text(run.parameters.run_id());
  const bool is_first = !std::exchange(is_folder_used_, true);
  Segment segment;
  segment.folder = options_.folder;
  if (is_first && !options_.unfinished) return segment;
  if (is_first && options_.unfinished->manifest().run_id == id)
    return make_next_segment(*options_.unfinished);

  segment.folder = options_.folder / name_run(run.parameters.run_id());
  const bool is_expected = !is_first || options_.follow || fs::exists(segment.folder) ||
                           options_.unfinished->manifest().outcome == "reset";
  if (!is_expected)
    throw app::RunError(fmt::format(
        "{}: run {} was replaced by run {}: expected the one that is to be resumed (--follow "
        "records the other one into a subfolder)",
        options_.folder.string(), options_.unfinished->manifest().run_id, id));
  const auto earlier = find_unfinished_recording(segment.folder);
  return earlier ? make_next_segment(*earlier) : segment;
}

}  // namespace sls::record
