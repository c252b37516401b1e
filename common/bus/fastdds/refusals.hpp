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

/// Logs which participants a secured domain refuses, and why: one line per participant, and at most
/// `kMostLines` in 10 s even during an attack. The name of a participant is the one it announces.
///
/// The middleware's events lack the reason, and the end that began the handshake gets no event at
/// all (README.md, trap 17). Upstream: none reported. To be deleted when both ends get an event
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

  /// The only instance, because a process has only one log of the middleware. It is never
  /// destroyed, because the middleware may still log while the process exits.
  static Refusals& of_process();

  /// This machine since its start, the namespace of its processes, and this process.
  static std::string name_process();

  /// Adds a discovered participant with its description. If it has a `claim`, the identity that it
  /// announces, it is reported unless `note_accepted` is called within `kTimeToProve`, or its
  /// `process` has ended on this machine: one that is killed does not say that it leaves.
  void note_discovered(const std::string& guid, const std::string& description,
                       const std::string& claim = {}, const std::string& process = {});
  void note_accepted(const std::string& guid);
  void note_gone(const std::string& guid);

  /// Reports a refused participant with `cause` or, if that is empty, with the cause that the
  /// middleware has just logged. Without any cause it reports nothing.
  void note_refused(const std::string& guid, const std::string& cause = {});

  /// Takes a line of the middleware's security log. If it names a known participant, it is reported
  /// as a refusal; otherwise it is kept as the cause for `note_refused`.
  void note_cause(const std::string& message);

 private:
  struct Pending {
    Clock::time_point deadline;
    std::string claim, process;
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
