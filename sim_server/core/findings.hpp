/// The mistakes of participants that the server reports, in words.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "common/sync/membership.hpp"

namespace sls::sim {

/// The mistakes that the server sees when it looks around. Each has a key of participant and kind,
/// which it keeps while it lasts.
class Findings {
 public:
  /// A shorter problem is ignored, because discovery and announcements take time, and a busy
  /// machine loses datagrams, too.
  static constexpr std::chrono::seconds kPatience{4};
  /// The same on a network that may lose packets: Fast DDS repeats lost discovery data once a
  /// second. With 20 % loss one in a hundred participants needs 8 to 10 s.
  static constexpr std::chrono::seconds kPatienceOnNetwork{15};

  /// The server looks around at `now`. Forgets what it found before, not how long it has lasted.
  void begin(sync::Time now, bool is_on_network);

  void add(const bus::PeerId& peer, const std::string& kind, std::string text);
  /// The same of a field of sls/participant.
  void add(const sync::Member& member, const std::string& kind, const char* field,
           const std::string& expected, const std::string& got);
  /// True if the problem has lasted for `patience()` without a break. Call it in each look that
  /// sees the problem.
  bool lasts(const bus::PeerId& peer, const std::string& kind);
  sync::Duration patience() const { return patience_; }

  /// True if there is a mistake of `peer` already, which may explain others.
  bool has_any(const bus::PeerId& peer) const;
  const std::map<std::string, std::string>& texts() const { return texts_; }
  /// When a pending problem will have lasted too long.
  const std::optional<sync::Time>& next_due() const { return next_due_; }

 private:
  sync::Time now_{};
  sync::Duration patience_ = kPatience;
  std::map<std::string, std::string> texts_;   // by key
  std::map<std::string, sync::Time> pending_;  // start of each problem
  std::set<std::string> seen_;                 // the pending ones of this look
  std::optional<sync::Time> next_due_;
};

/// "controller 'foo' on box"
std::string describe_participant(const sync::Member& member);
/// "controller 'foo' on box: sls/participant FIELD: expected A, got B"
std::string describe_field(const sync::Member& member, const char* field,
                           const std::string& expected, const std::string& got);
/// The hash or identifier as text, "none" if it is empty or "0".
std::string to_words(const std::string& sha256);
std::string to_words(std::uint64_t run_id);

}  // namespace sls::sim
