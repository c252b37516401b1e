#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>

namespace sls::bus {

/// Says on stderr who was kept from a secured domain, and why: one line per participant, and no
/// more than `kMostLines` in 10 s, whatever an attacker sends. The name of a participant is what
/// it says of itself.
///
/// The middleware's events lack the reason, and at the end that began the handshake there is none
/// at all (README.md, trap 17). Upstream: none reported. To be deleted when both ends get an event
/// with the reason.
class Refusals {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kTimeToProve{5};  ///< the handshake takes milliseconds
  static constexpr int kMostLines = 5;
  static constexpr std::size_t kMostKnown = 1000;

  Refusals() = default;
  ~Refusals();
  Refusals(const Refusals&) = delete;
  Refusals& operator=(const Refusals&) = delete;

  /// The one of this process, because the log of the middleware is one; never destroyed, as the
  /// middleware may still log while the process exits.
  static Refusals& of_process();

  /// A participant was discovered, and is called `description`. Unless `note_accepted` comes in
  /// time it is reported with `claim`, what it says of its identity; nothing is expected without
  /// one.
  void note_discovered(const std::string& guid, const std::string& description,
                       const std::string& claim = {});
  void note_accepted(const std::string& guid);
  void note_gone(const std::string& guid);

  /// It was refused: for `cause`, or for what the middleware has just logged, as far as it did.
  void note_refused(const std::string& guid, const std::string& cause = {});

  /// A line of the middleware's security log: a refusal, or the cause of one in `note_refused`.
  void note_cause(const std::string& message);

 private:
  struct Pending {
    Clock::time_point deadline;
    std::string claim;
  };

  void watch();
  void report(const std::string& guid, const std::string& cause);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, std::string> known_;  // descriptions, by GUID
  std::map<std::string, Pending> pending_;    // participants without a proven identity yet
  std::set<std::string> reported_;
  std::string cause_;  // the last that was logged
  Clock::time_point window_began_{};
  int lines_ = 0;
  int left_out_ = 0;
  bool is_over_ = false;
  std::thread watcher_;  // a handshake that fails at the other end ends here without an event
};

}  // namespace sls::bus
