/// When the recording of a run ends, and when its recorder announces itself.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/sync/line.hpp"
#include "common/sync/patience.hpp"
#include "common/sync/server_watch.hpp"
#include "common/sync/servers.hpp"

namespace sls::record {

class RunWatch {
 public:
  /// The knowledge of the shell at a look.
  struct Now {
    sync::Time time;
    std::string interruption{};  ///< such as "interrupted by SIGINT"; empty before a stop signal
    bool hears_server = false;   ///< both topics of the recording are matched with the run's server
    std::int64_t last_complete_step = -1;
  };
  /// Why a recording ends before it has all rows.
  struct End {
    std::string outcome = "interrupted";
    std::string interruption;
    bool is_reset = false;                 ///< by an operator: the same server begins a new run
    std::optional<sync::Run> replacement;  ///< a run of another server that replaces this one
  };

  /// Watches `run`, which is recorded because it has `vehicle`, from `now` on. The recorder has
  /// just announced itself.
  RunWatch(const sync::Run& run, std::uint32_t vehicle, double server_deadline_s, const Now& now);

  /// True once no further samples are waited for.
  bool look(const sync::Servers& servers, const Now& now);
  const End& end() const { return end_; }

  /// True if the recorder must announce itself now.
  bool is_announcement_due(const Now& now);
  /// The recorder hears the server of its run.
  bool is_ready() const { return is_ready_; }

  std::vector<sync::Line> take_lines() { return std::exchange(lines_, {}); }

 private:
  void look_at_server(const sync::Servers& servers, sync::Time now);
  void look_for_next_run(const sync::Servers& servers, sync::Time now);
  void end_within(double limit_s, sync::Time now);

  const sync::Run run_;
  const std::uint64_t run_id_;
  const std::uint32_t vehicle_;
  const double server_deadline_s_;
  sync::ServerWatch server_;
  std::optional<sync::Patience> give_up_;  // once the run is known to end
  std::int64_t step_after_end_ = -1;       // last complete step at the last look after the end
  bool is_ready_ = false;
  std::int64_t announced_step_;
  sync::Time announced_time_;
  End end_;
  std::vector<sync::Line> lines_;
};

}  // namespace sls::record
