#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/sync/line.hpp"
#include "common/sync/patience.hpp"
#include "common/sync/time.hpp"

namespace sls::sync {

/// Watches the server of a run, which publishes a status at least every 0.5 s: within 1 s and then
/// every 5 s it has a line about the silence of the server, and one when it is back.
class ServerWatch {
 public:
  /// Watches run `run_id` from `now` on; its server is lost after `deadline_s` of silence.
  ServerWatch(std::uint64_t run_id, double deadline_s, Time now)
      : run_id_(run_id), deadline_s_(deadline_s), heard_(now) {}

  enum class Finding { kThere, kSilent, kLost };
  /// `heard`: when the last status came (Servers::find_last_heard). Call it several times a second.
  Finding look(const std::optional<Time>& heard, Time now);

  /// The line of the last look, if there is something to say: a warning of silence, or that the
  /// server is back.
  const std::optional<Line>& report() const { return report_; }

  /// For messages: "server of run … (silent for 3.1 s)".
  std::string describe(Time now) const;

 private:
  const std::uint64_t run_id_;
  const double deadline_s_;
  Time heard_;
  std::optional<Patience> wait_;  // while it is silent
  bool is_reported_ = false;
  std::optional<Line> report_;
};

}  // namespace sls::sync
