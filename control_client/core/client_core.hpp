/// Which run a client flies: it finds one, flies it, follows it and ends with it. No network,
/// thread or clock here: the shell (control_client/client.hpp) looks every few milliseconds and
/// does what comes out.
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

namespace sls::control {

class ClientCore {
 public:
  struct Options {
    std::vector<std::uint32_t> vehicle_ids;  ///< ascending, at least one
    Participant identity;                    ///< what every announcement says
    double join_timeout_s = 0;               ///< until a server must be found
    double server_deadline_s = 0;            ///< a server that is silent for this long is lost
    bool follows_servers = false;            ///< as in ClientOptions
  };
  /// The knowledge of the shell at a look.
  struct Now {
    sync::Time time;
    bool is_stopped = false;
    bool sees_server = false;  ///< both topics of the loop are matched with the run's server
  };
  enum class Phase { kFinding, kFlying, kEnded };
  enum class Act {
    kNone,
    kBegin,          ///< join run(), then go on looking
    kAnnounceReady,  ///< the server hears the answers from now on: announce it
    kLeave,          ///< announce that the client has left run(), and end
    kGiveUp,         ///< end
  };

  /// Begins to wait for a server with the first look.
  explicit ClientCore(Options options) : options_(std::move(options)) {}

  /// Once the phase is kEnded, error() says whether something is wrong.
  Act look(const sync::Servers& servers, const Now& now);
  /// When the next look is due.
  sync::Time next_deadline() const { return deadline_; }

  Phase phase() const { return phase_; }
  /// The run that is flown; empty before the first.
  const std::optional<sync::Run>& run() const { return run_; }
  /// Those of our vehicles that the run has.
  std::vector<std::uint32_t> list_flown_ids() const;
  /// The announcement for the present phase.
  Participant make_announcement() const;
  /// Why the client ends; empty if there is nothing wrong.
  const std::string& error() const { return error_; }
  std::vector<sync::Line> take_lines() { return std::exchange(lines_, {}); }

 private:
  Act decide(const sync::Servers& servers, const Now& now);
  Act find(const sync::Servers& servers, const Now& now);
  Act fly(const sync::Servers& servers, const Now& now);
  Act begin(const sync::Run& run, sync::Time now);
  Act follow(const sync::Run& next, sync::Time now);
  Act end(Act act, std::string error = {});

  const Options options_;
  Phase phase_ = Phase::kFinding;
  sync::Time deadline_;
  std::optional<sync::Patience> patience_;  // of finding the first run
  std::optional<sync::Run> run_;
  std::optional<sync::ServerWatch> watch_;  // of the run
  bool is_ready_ = false;
  std::string error_;
  std::vector<sync::Line> lines_;
};

}  // namespace sls::control
