/// Controllers and recorders of a domain, by their announcements in sls/participant. No network and
/// no clock here.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "common/bus/peer.hpp"
#include "common/sync/time.hpp"
#include "sls.h"

namespace sls::sync {

/// Participants announce themselves at least every 0.5 s. One silent for this long is presumed dead
/// until its next announcement. (The middleware's lease is much longer: docs/networks.md.)
inline constexpr auto kPresumedDeadAfter = std::chrono::seconds(2);
/// Our programs repeat their announcement after this: with the time between two looks, less than
/// 0.5 s.
inline constexpr auto kRepeatAfter = std::chrono::milliseconds(400);

/// A participant that is present.
struct Member {
  bus::PeerId peer;
  Participant announcement;  ///< the last one
  Time heard;                ///< time of its arrival
  /// Smallest age of its last announcements on arrival, by the sender's clock and ours: the delay
  /// of the network and of discovery, and how far the sender's clock is behind.
  std::chrono::nanoseconds age{0};
  /// Time of the first announcement for this run with `ready`.
  Time ready_since{};
  /// The sender repeats this announcement about every 0.5 s: then its silence means that it is
  /// gone. Clients of this contract need not repeat it.
  bool is_repeated = false;
  /// The server sets this, for it knows the answers too
  /// (sim_server/core/participants/presence.hpp).
  bool is_gone = false;

  bool is_silent(Time now) const { return now - heard > kPresumedDeadAfter; }
  /// Its silence means that it is gone.
  bool is_presumed_dead(Time now) const { return is_repeated && is_silent(now); }
};

/// The last announcement of every controller and recorder. At most 256 participants, because other
/// programs must not fill the memory; a new one replaces one that has left.
class Membership {
 public:
  static constexpr std::size_t kMostMembers = 256;

  /// Times of a sample.
  struct Arrival {
    Time time;
    std::chrono::system_clock::time_point written;  ///< by the sender's clock
    std::chrono::nanoseconds age{0};                ///< by the sender's clock and ours
  };

  /// Sets the participants with a writer of sls/participant. Others are not present.
  void set_present(const std::set<bus::PeerId>& present) {
    if (present != present_) present_ = present;  // asked at every look, and rarely new
  }
  const std::set<bus::PeerId>& present() const { return present_; }

  void note(const Participant& sample, const bus::PeerId& sender, const Arrival& arrival);

  /// Present participants of `role` that serve run `run_id`.
  std::vector<Member> find(ParticipantRole role, std::uint64_t run_id) const;

  /// Present participants of every role and run.
  std::vector<Member> all() const;

  /// Number of participants of `role` that have announced `done` for run `run_id`, also of those
  /// that have left since.
  int count_done(ParticipantRole role, std::uint64_t run_id) const;

  /// Changes with every announcement that differs from the one before it. It does
  /// not change when a participant leaves, falls silent, or is heard again.
  std::uint64_t version() const { return version_; }

 private:
  struct Heard {
    Participant announcement;
    Time time;
    std::deque<std::chrono::nanoseconds> ages;  // of the last announcements
    std::optional<Time> ready_since;
    std::chrono::system_clock::time_point written;  // by the sender's clock
    int repeats = 0;  // announcements without a change at about the usual interval, in a row
  };

  /// Present participants whose announcement `is_wanted`.
  template <class IsWanted>
  std::vector<Member> collect(const IsWanted& is_wanted) const;

  std::map<bus::PeerId, Heard> last_;
  std::set<bus::PeerId> present_;
  std::uint64_t version_ = 0;
};

/// True if each of `recorders` has announced `done` or is silent.
bool are_recorders_done(const std::vector<Member>& recorders, Time now);

/// True if the announcement `controller` includes `vehicle_id`.
bool flies_vehicle(const Participant& controller, std::uint32_t vehicle_id);

}  // namespace sls::sync
