#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>

namespace sls::bus {

/// Mistakes of participants that this program has detected. A mistake is logged in one line when it
/// begins, and is listed while it holds. At most `kMostLines` lines in 10 s and `kMost` mistakes,
/// because other programs may send anything. May be used from any thread.
class Problems {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kMostLines = 5;
  static constexpr std::size_t kMost = 256;

  /// The mistake `key` holds until `end` or, if `lasting` is given, for that time from now. Only
  /// its first text is logged and listed. A mistake that has run out is a new one if it recurs.
  void begin(const std::string& key, const std::string& text,
             std::optional<Clock::duration> lasting = std::nullopt);
  void end(const std::string& key);
  /// Ends every mistake whose key begins with `prefix`.
  void end_all(const std::string& prefix);
  /// Makes `found` (text by key) the only mistakes whose keys begin with `prefix`.
  void replace(const std::string& prefix, const std::map<std::string, std::string>& found);

  /// Replaces `from` by `to` in the texts of the mistakes whose keys contain `part`, and logs the
  /// new texts: `from` did not tell who makes the mistake.
  void rename(const std::string& part, const std::string& from, const std::string& to);

  /// True if a mistake holds whose key begins with `prefix`.
  bool has_any(const std::string& prefix) const;

  /// Changes when a mistake begins, ends or gets another text (not when one that lasts for a time
  /// runs out).
  std::uint64_t version() const { return version_.load(std::memory_order_acquire); }

  /// The mistakes that hold, oldest first, in at most `most` bytes; empty if none does.
  std::string describe(std::size_t most = 255) const;

 private:
  struct Problem {
    std::string text;
    std::uint64_t number = 0;  // counts the mistakes
    std::optional<Clock::time_point> end;

    bool holds(Clock::time_point now) const { return !end || now < *end; }
  };

  void add(const std::string& key, const std::string& text, std::optional<Clock::duration> lasting);
  void drop_expired(Clock::time_point now);
  void say(const std::string& text);

  mutable std::mutex mutex_;
  std::map<std::string, Problem> problems_;
  std::uint64_t count_ = 0;
  std::atomic<std::uint64_t> version_{0};
  Clock::time_point window_began_{};
  int lines_ = 0;
  int left_out_ = 0;
};

}  // namespace sls::bus
