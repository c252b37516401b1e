#include "common/bus/fastdds/neighbours.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "common/bus/topics.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::bus {
namespace {

constexpr std::chrono::seconds kMisfitLasts(5);

std::string to_hex(const std::uint8_t* bytes, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += fmt::format("{:02x}", bytes[i]);
  return text;
}

std::string to_text(const PeerId& peer) { return to_hex(peer.bytes.data(), peer.bytes.size()); }

/// Keys of problems: "dds PARTICIPANT ENDPOINT WHAT".
std::string make_key(const PeerId& peer) { return "dds " + to_text(peer) + " "; }
std::string make_key(const PeerId& peer, const Neighbours::EntityId& id) {
  return make_key(peer) + to_hex(id.data(), id.size()) + " ";
}

bool begins_with(const std::string& text, const std::string& prefix) {
  return text.compare(0, prefix.size(), prefix) == 0;
}

bool is_ours(const std::string& topic) { return begins_with(topic, "sls/"); }

bool is_same(const EndpointFacts& a, const EndpointFacts& b) {
  return a.topic == b.topic && a.is_writer == b.is_writer;
}

}  // namespace

void Neighbours::set_self(const PeerId& self) {
  const std::lock_guard lock(mutex_);
  self_ = self;
}

void Neighbours::note_participant(const PeerId& peer, const std::string& name,
                                  const std::string& address, const std::string& obstacle) {
  const std::lock_guard lock(mutex_);
  if (participants_.size() >= kMostParticipants && participants_.count(peer) == 0) return;
  Participant& participant = participants_[peer];
  participant.name = name;
  participant.address = address;
  participant.obstacle = obstacle;
  describe_anew(peer, participant);
}

void Neighbours::note_announced_name(const PeerId& peer, const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto known = participants_.find(peer);
  if (name.empty() || known == participants_.end() || known->second.announced_name == name) return;
  known->second.announced_name = name;
  describe_anew(peer, known->second);
}

void Neighbours::describe_anew(const PeerId& peer, Participant& participant) {
  const std::string& name =
      participant.announced_name.empty() ? participant.name : participant.announced_name;
  std::string text = describe_name(name);
  if (!participant.address.empty()) text += " (" + config::to_printable(participant.address) + ")";
  const std::string before = std::exchange(participant.description, text);
  if (before.empty() || before == text) return;
  for (auto& [endpoint, words] : missing_deadlines_) {
    const auto place = endpoint.first == peer ? words.find(before) : words.npos;
    if (place != words.npos) words.replace(place, before.size(), text);
  }
  problems_.rename(" " + to_text(peer) + " ", before, text);  // also of other keys than ours
}

void Neighbours::drop_participant(const PeerId& peer) {
  const std::lock_guard lock(mutex_);
  participants_.erase(peer);
  const auto is_his = [&](const auto& item) { return item.first.first == peer; };
  for (auto it = endpoints_.begin(); it != endpoints_.end();)
    it = is_his(*it) ? endpoints_.erase(it) : std::next(it);
  for (auto it = missing_deadlines_.begin(); it != missing_deadlines_.end();)
    it = is_his(*it) ? missing_deadlines_.erase(it) : std::next(it);
  problems_.end_all(make_key(peer));
}

void Neighbours::note_endpoint(const PeerId& peer, const EntityId& id, const EndpointFacts& facts) {
  if (!is_ours(facts.topic) && !find_meant_topic(facts)) return;
  const std::lock_guard lock(mutex_);
  if (peer == self_) return;
  const Endpoint endpoint(peer, id);
  if (endpoints_.size() >= kMostEndpoints && endpoints_.count(endpoint) == 0) return;
  endpoints_[endpoint] = facts;
  const auto known = participants_.find(peer);
  if (known != participants_.end() && !known->second.obstacle.empty())
    problems_.begin(make_key(peer) + "obstacle",
                    known->second.description + ": " + known->second.obstacle);
  judge(endpoint, facts);
}

void Neighbours::drop_endpoint(const PeerId& peer, const EntityId& id) {
  const std::lock_guard lock(mutex_);
  if (endpoints_.erase({peer, id}) == 0) return;
  missing_deadlines_.erase({peer, id});
  problems_.end_all(make_key(peer, id));
}

void Neighbours::add_own(const EndpointFacts& facts) {
  if (!is_ours(facts.topic)) return;
  const std::lock_guard lock(mutex_);
  own_.push_back(facts);
  for (const auto& [endpoint, other] : endpoints_) judge(endpoint, other);
}

void Neighbours::drop_own(const EndpointFacts& facts) {
  const std::lock_guard lock(mutex_);
  const auto own = std::find_if(own_.begin(), own_.end(),
                                [&](const EndpointFacts& item) { return is_same(item, facts); });
  if (own == own_.end()) return;
  own_.erase(own);
  for (const auto& [endpoint, other] : endpoints_) judge(endpoint, other);
}

void Neighbours::judge(const Endpoint& endpoint, const EndpointFacts& facts) {
  const auto& [peer, id] = endpoint;
  const std::string place = fmt::format("{} {} {}", config::to_printable(facts.topic),
                                        facts.is_writer ? "of" : "for", describe_held(peer));
  if (const auto meant = find_meant_topic(facts)) {
    // ROS 2 changes the names of all topics, so this is reported once per participant.
    const bool is_of_ros = begins_with(facts.topic, "rt/");
    problems_.begin(
        (is_of_ros ? make_key(peer) : make_key(peer, id)) + "topic",
        place + ": expected topic " + *meant + (is_of_ros ? " (without the prefix of ROS 2)" : ""));
    return;
  }
  std::string text, missing_deadline;
  for (const EndpointFacts& own : own_)
    for (const Mismatch& mismatch : compare(own, facts)) {
      const bool is_of_others =
          mismatch.policy == "DEADLINE" && facts.topic == Topic<Commands>::kName;
      std::string& words = is_of_others ? missing_deadline : text;
      if (words.find(mismatch.text) == words.npos)
        words += (words.empty() ? place + ": " : "; ") + mismatch.text;
    }
  if (missing_deadline.empty())
    missing_deadlines_.erase(endpoint);
  else
    missing_deadlines_[endpoint] = missing_deadline;
  // Wrongly compiled types differ on every topic, so they are reported once per participant.
  const bool is_of_types = text.find("DATA_REPRESENTATION") != text.npos;
  const std::string key = (is_of_types ? make_key(peer) : make_key(peer, id)) + "fit";
  if (text.empty())
    problems_.end(key);
  else
    problems_.begin(key, text);
}

void Neighbours::note_misfit(const PeerId& peer, const EntityId& writer, const std::string& topic,
                             const std::string& type, const std::string& defect) {
  const std::lock_guard lock(mutex_);
  if (endpoints_.count({peer, writer}) == 0) return;
  problems_.begin(make_key(peer, writer) + "length",
                  fmt::format("{} of {}: {}: {}", topic, describe_held(peer), type, defect),
                  kMisfitLasts);
}

void Neighbours::note_problem(const PeerId& peer, const std::string& key, const std::string& text) {
  const std::lock_guard lock(mutex_);
  if (participants_.count(peer) > 0)
    problems_.begin(make_key(peer) + key, describe_held(peer) + ": " + text);
}

void Neighbours::end_problem(const PeerId& peer, const std::string& key) {
  problems_.end(make_key(peer) + key);
}

std::string Neighbours::describe(const PeerId& peer) const {
  const std::lock_guard lock(mutex_);
  return describe_held(peer);
}

std::string Neighbours::describe_held(const PeerId& peer) const {
  const auto known = participants_.find(peer);
  return known == participants_.end() ? "a participant without a name" : known->second.description;
}

std::set<PeerId> Neighbours::find_misfits() const {
  const std::lock_guard lock(mutex_);
  std::set<PeerId> found;
  for (const auto& [peer, participant] : participants_)
    if (problems_.has_any(make_key(peer))) found.insert(peer);
  return found;
}

std::map<PeerId, std::string> Neighbours::find_missing_deadlines() const {
  const std::lock_guard lock(mutex_);
  std::map<PeerId, std::string> found;
  for (const auto& [endpoint, text] : missing_deadlines_) found.emplace(endpoint.first, text);
  return found;
}

std::map<PeerId, std::set<std::string>> Neighbours::find_writers_of_servers() const {
  const std::lock_guard lock(mutex_);
  std::map<PeerId, std::set<std::string>> found;
  for (const auto& [endpoint, facts] : endpoints_)
    for (const char* topic :
         {Topic<States>::kName, Topic<SimStatus>::kName, Topic<RecordBatch>::kName})
      if (facts.is_writer && facts.topic == topic) found[endpoint.first].insert(topic);
  return found;
}

std::string describe_name(const std::string& name) {
  return name.empty() ? "a participant without a name" : "'" + config::to_printable(name) + "'";
}

}  // namespace sls::bus
