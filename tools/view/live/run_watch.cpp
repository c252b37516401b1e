#include "tools/view/live/run_watch.hpp"

#include <utility>

#include "tools/ctl/operator_client.hpp"

namespace sls::view {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostEvents = 1000;
constexpr std::size_t kMostRuns = 64;

}  // namespace

RunWatch::RunWatch(bus::Node& node, std::uint32_t vehicle_id, std::function<void()> on_status)
    : vehicle_id_(vehicle_id),
      on_status_(std::move(on_status)),
      participants_(node),
      servers_(node, [this](const SimStatus& status) {
        note(status);
        on_status_();
      }) {}

void RunWatch::note(const SimStatus& status) {
  std::string reason = status.reason().to_string();
  const std::lock_guard lock(events_mutex_);
  if (last_reasons_.size() >= kMostRuns && last_reasons_.count(status.run_id()) == 0)
    last_reasons_.clear();
  std::string& last = last_reasons_[status.run_id()];
  if (reason.empty() || reason == last) return;
  last = reason;
  events_.push_back({status.run_id(), status.step(), std::move(reason)});
  if (events_.size() > kMostEvents) events_.pop_front();
}

std::deque<RunEvent> RunWatch::take_events() {
  const std::lock_guard lock(events_mutex_);
  return std::exchange(events_, {});
}

std::optional<sync::Run> RunWatch::choose_run() const {
  auto best = servers_.find_joinable(vehicle_id_);
  if (!run_) return best ? best : ctl::find_any_run(servers_, vehicle_id_);
  const std::uint64_t run_id = run_->parameters.run_id();
  const auto status = servers_.find_status(run_id);
  const bool goes_on = servers_.is_known(run_id) && sync::calc_progress(status) >= 0;
  if (best && (!goes_on || best->parameters.run_id() == run_id)) return best;
  sync::Run run = *run_;
  if (status) run.status = status;
  return run;
}

std::shared_ptr<const RunView> RunWatch::look() {
  run_ = choose_run();
  if (!run_) {
    has_changed_ = false;
    return nullptr;
  }
  auto view = std::make_shared<RunView>();
  view->run = *run_;
  const std::uint64_t run_id = run_->parameters.run_id();
  for (const auto& entry : participants_.all())
    if (entry.announcement.run_id() == run_id || entry.announcement.run_id() == 0)
      view->participants.push_back(entry.announcement);
  view->is_gone = !servers_.is_present(run_->server);
  if (const auto heard = servers_.find_last_heard(run_id))
    view->silence_s = std::chrono::duration<double>(Clock::now() - *heard).count();
  view->is_silent = sync::calc_progress(run_->status) >= 0 && view->silence_s > ctl::kLongSilence;
  const Mark mark{run_id,
                  run_->status ? run_->status->sample_index() + 1 : 0,
                  participants_.version(),
                  view->participants.size(),
                  view->is_silent,
                  view->is_gone};
  has_changed_ = mark != std::exchange(mark_, mark);
  return view;
}

}  // namespace sls::view
