#include "tools/ctl/show_status.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <optional>
#include <string>
#include <thread>

#include "common/app/run_error.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/wait.hpp"
#include "tools/ctl/screen.hpp"

namespace sls::ctl {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kRedrawTime = 250ms;
constexpr auto kLineTime = 1s;
/// Discovery finds the participants of a run about as soon as their server, if no packet is lost.
constexpr auto kDiscoveryTime = 400ms;
constexpr double kLongestDiscovery = 3.0;  // s
constexpr auto kFreshTime = 1500ms;        // a healthy server publishes every 0.5 s
constexpr std::size_t kFileColumns = 160;

void check_written(const std::ostream& out) {
  if (!out) throw app::RunError("standard output: cannot write");
}

bool is_interrupted() { return app::stop_signal() != 0; }

/// Waits until the announcements of all participants have come.
void wait_for_discovery(const OperatorClient& client) {
  const auto began = Clock::now();
  const app::Wait wait(kLongestDiscovery);
  while (!is_interrupted() &&
         (Clock::now() - began < kDiscoveryTime || !client.has_heard_everyone())) {
    if (wait.is_over()) {
      spdlog::warn("not every participant was heard within {} s: some may be missing below",
                   kLongestDiscovery);
      return;
    }
    std::this_thread::sleep_for(app::kPollTime);
  }
}

/// `run` with a status published from now on, if one comes within kFreshTime; otherwise with the
/// status that the server keeps for late joiners.
sync::Run wait_for_fresh_status(const OperatorClient& client, sync::Run run) {
  const auto began = Clock::now();
  run = client.refresh(run);
  const std::uint64_t left = run.status->sample_index();
  while (!is_interrupted() && Clock::now() - began < kFreshTime) {
    std::this_thread::sleep_for(app::kPollTime);
    run = client.refresh(run);
    if (has_ended(run.status) || run.status->sample_index() != left) break;
  }
  return run;
}

void show_once(const OperatorClient& client, const ShowOptions& options, sync::Run run,
               std::ostream& out) {
  wait_for_discovery(client);
  run = wait_for_fresh_status(client, std::move(run));
  if (is_interrupted()) return;
  const Snapshot snapshot = client.make_snapshot(run);
  if (options.json) {
    out << to_json(snapshot) << "\n";
  } else {
    const auto columns = options.terminal ? find_screen_size().columns : kFileColumns;
    for (const std::string& line : render(snapshot, columns)) out << line << "\n";
  }
  out << std::flush;
  check_written(out);
}

/// Writes one line at each change, and at least every kLineTime.
class LineWriter {
 public:
  LineWriter(std::ostream& out, bool json) : out_(out), json_(json) {}

  void offer(const Snapshot& snapshot) {
    const auto now = Clock::now();
    if (!is_news(snapshot) && now - last_time_ < kLineTime) return;
    out_ << (json_ ? to_json(snapshot) : render_line(snapshot)) << std::endl;
    last_time_ = now;
  }

 private:
  /// True for another run, phase, problem or reason. An empty reason is no change, because each
  /// reason is published once.
  bool is_news(const Snapshot& snapshot) {
    const std::uint64_t run_id = snapshot.parameters.run_id();
    std::string reason = snapshot.status ? snapshot.status->reason().to_string() : "";
    if (reason.empty()) reason = last_reason_;
    const auto phase = snapshot.status ? std::optional(snapshot.status->phase()) : std::nullopt;
    const std::string problem = snapshot.status ? snapshot.status->problem().to_string() : "";
    const bool is_new = run_id != last_run_id_ || phase != last_phase_ || reason != last_reason_ ||
                        problem != last_problem_;
    last_run_id_ = run_id;
    last_phase_ = phase;
    last_reason_ = reason;
    last_problem_ = problem;
    return is_new;
  }

  std::ostream& out_;
  const bool json_;
  std::uint64_t last_run_id_ = 0;
  std::optional<RunPhase> last_phase_;
  std::string last_reason_;
  std::string last_problem_;
  Clock::time_point last_time_;
};

/// Redraws the view every kRedrawTime, and once more at the end.
class ViewWriter {
 public:
  explicit ViewWriter(std::ostream& out) : screen_(out) {}

  void offer(const Snapshot& snapshot) {
    const auto now = Clock::now();
    if (now < next_ && !has_ended(snapshot.status)) return;
    const ScreenSize size = find_screen_size();
    screen_.draw(render(snapshot, size.columns), size);
    next_ = now + kRedrawTime;
  }

 private:
  Screen screen_;
  Clock::time_point next_;
};

template <class OutputWriter>
void watch(const OperatorClient& client, double timeout_s, sync::Run run, OutputWriter& writer,
           std::ostream& out) {
  while (!is_interrupted()) {
    run = client.refresh(run);
    const Snapshot snapshot = client.make_snapshot(run);
    writer.offer(snapshot);
    check_written(out);
    if (has_ended(snapshot.status)) return;
    if (snapshot.server_is_gone && snapshot.silence_s > timeout_s)
      throw app::RunError(fmt::format("the server of run {:016x} is gone, silent for {:.1f} s",
                                      run.parameters.run_id(), snapshot.silence_s));
    std::this_thread::sleep_for(app::kPollTime);
  }
}

}  // namespace

void show_status(const OperatorClient& client, const ShowOptions& options, std::ostream& out) {
  const auto run = client.wait_for_any_run();
  if (!run) return;
  if (!options.watch) return show_once(client, options, *run, out);
  if (options.terminal && !options.json) {
    ViewWriter view(out);
    watch(client, options.timeout_s, *run, view, out);
  } else {
    LineWriter lines(out, options.json);
    watch(client, options.timeout_s, *run, lines, out);
  }
}

}  // namespace sls::ctl
