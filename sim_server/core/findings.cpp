#include "sim_server/core/findings.hpp"

#include <spdlog/fmt/fmt.h>

#include <iterator>
#include <utility>

#include "common/bus/names.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::sim {
namespace {

std::string make_key(const bus::PeerId& peer, const std::string& kind) {
  std::string key = "run ";
  for (const std::uint8_t byte : peer.bytes) key += fmt::format("{:02x}", byte);
  return key + " " + kind;
}

}  // namespace

void Findings::begin(sync::Time now, bool is_on_network) {
  for (auto it = pending_.begin(); it != pending_.end();)
    it = seen_.count(it->first) > 0 ? std::next(it) : pending_.erase(it);
  seen_.clear();
  texts_.clear();
  next_due_.reset();
  now_ = now;
  patience_ = is_on_network ? kPatienceOnNetwork : kPatience;
}

void Findings::add(const bus::PeerId& peer, const std::string& kind, std::string text) {
  texts_[make_key(peer, kind)] = std::move(text);
}

void Findings::add(const sync::Member& member, const std::string& kind, const char* field,
                   const std::string& expected, const std::string& got) {
  add(member.peer, kind, describe_field(member, field, expected, got));
}

bool Findings::lasts(const bus::PeerId& peer, const std::string& kind) {
  const std::string key = make_key(peer, kind);
  seen_.insert(key);
  const sync::Time due = pending_.try_emplace(key, now_).first->second + patience_;
  if (now_ >= due) return true;
  if (!next_due_ || due < *next_due_) next_due_ = due;
  return false;
}

bool Findings::has_any(const bus::PeerId& peer) const {
  const std::string prefix = make_key(peer, "");
  const auto own = texts_.lower_bound(prefix);
  return own != texts_.end() && own->first.compare(0, prefix.size(), prefix) == 0;
}

std::string describe_participant(const sync::Member& member) {
  const Participant& announcement = member.announcement;
  const ParticipantRole role = announcement.role();
  const bool is_defined =
      role == ParticipantRole::ROLE_CONTROLLER || role == ParticipantRole::ROLE_RECORDER;
  return fmt::format("{} '{}' on {}", is_defined ? bus::to_string(role) : "participant",
                     config::to_printable(announcement.name().to_string(), 32),
                     config::to_printable(announcement.host().to_string(), 64));
}

std::string describe_field(const sync::Member& member, const char* field,
                           const std::string& expected, const std::string& got) {
  return fmt::format("{}: sls/participant {}: expected {}, got {}", describe_participant(member),
                     field, expected, got);
}

std::string to_words(const std::string& sha256) {
  if (sha256.empty()) return "none";
  return config::to_printable(sha256, 64);
}

std::string to_words(std::uint64_t run_id) {
  if (run_id == 0) return "0";
  return fmt::format("{:016x}", run_id);
}

}  // namespace sls::sim
