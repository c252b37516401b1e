/// Chooses the current run and collects its data.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>

#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "tools/view/live/feed.hpp"

namespace sls::view {

/// Call the functions from one thread. Samples arrive on threads of the middleware.
class RunWatch {
 public:
  /// `on_status`: called on a thread of the middleware at every status.
  RunWatch(bus::Node& node, std::uint32_t vehicle_id, std::function<void()> on_status);

  /// The view as it is now; null: there has been no run yet.
  std::shared_ptr<const RunView> look();
  /// True if the last `look` found other data than the one before.
  bool has_changed() const { return has_changed_; }
  /// Events since the last call, oldest first.
  std::deque<RunEvent> take_events();

 private:
  /// The view has changed if one of these values has.
  using Mark = std::tuple<std::uint64_t, std::uint64_t, std::uint64_t, std::size_t, bool, bool>;

  std::optional<sync::Run> choose_run() const;
  void note(const SimStatus& status);

  const std::uint32_t vehicle_id_;
  const std::function<void()> on_status_;
  std::mutex events_mutex_;  // protects the next two members
  std::deque<RunEvent> events_;
  std::map<std::uint64_t, std::string> last_reasons_;  // by run_id
  std::optional<sync::Run> run_;
  Mark mark_{};
  bool has_changed_ = false;
  bus::ParticipantDirectory participants_;
  bus::ServerDirectory servers_;  // last: its callback uses the members above
};

}  // namespace sls::view
