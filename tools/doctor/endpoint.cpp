#include "tools/doctor/endpoint.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <sstream>
#include <utility>

namespace sls::doctor {
namespace {

constexpr std::array<const char*, 2> kReliability = {"BEST_EFFORT", "RELIABLE"};
constexpr std::array<const char*, 4> kDurability = {"VOLATILE", "TRANSIENT_LOCAL", "TRANSIENT",
                                                    "PERSISTENT"};
constexpr std::array<const char*, 3> kLiveliness = {"AUTOMATIC", "MANUAL_BY_PARTICIPANT",
                                                    "MANUAL_BY_TOPIC"};
constexpr std::array<const char*, 2> kOwnership = {"SHARED", "EXCLUSIVE"};

template <std::size_t size>
std::string name_kind(const std::array<const char*, size>& names, int kind) {
  return kind >= 0 && kind < static_cast<int>(size) ? names.at(static_cast<std::size_t>(kind))
                                                    : std::to_string(kind);
}

std::string name_duration(std::int64_t duration_ns) {
  if (duration_ns == kForeverNs) return "infinite";
  std::ostringstream text;
  text << static_cast<double>(duration_ns) * 1e-9 << " s";
  return text.str();
}

std::string name_partitions(const std::vector<std::string>& partitions) {
  std::string text;
  for (const auto& partition : partitions) text += (text.empty() ? "'" : ", '") + partition + "'";
  return text.empty() ? "the default" : text;
}

bool share_partition(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  if (a.empty() && b.empty()) return true;
  return std::any_of(a.begin(), a.end(), [&](const std::string& partition) {
    // A pattern may match anything: give it the benefit of the doubt.
    return partition.find_first_of("*?[") != partition.npos ||
           std::find(b.begin(), b.end(), partition) != b.end();
  });
}

}  // namespace

std::vector<Mismatch> find_policy_mismatches(const Endpoint& writer, const Endpoint& reader) {
  std::vector<Mismatch> found;
  const auto expect = [&](bool matches, const std::string& policy, const std::string& offered,
                          const std::string& asked) {
    if (matches) return;
    found.push_back({writer.topic, policy,
                     writer.owner + " offers " + policy + " " + offered + ", " + reader.owner +
                         " asks for " + asked});
  };
  const Policies &offered = writer.policies, &asked = reader.policies;
  expect(offered.reliability >= asked.reliability, "reliability",
         name_kind(kReliability, offered.reliability), name_kind(kReliability, asked.reliability));
  expect(offered.durability >= asked.durability, "durability",
         name_kind(kDurability, offered.durability), name_kind(kDurability, asked.durability));
  expect(offered.deadline_ns <= asked.deadline_ns, "deadline", name_duration(offered.deadline_ns),
         name_duration(asked.deadline_ns));
  expect(offered.liveliness >= asked.liveliness, "liveliness",
         name_kind(kLiveliness, offered.liveliness), name_kind(kLiveliness, asked.liveliness));
  expect(offered.liveliness_lease_ns <= asked.liveliness_lease_ns, "liveliness lease",
         name_duration(offered.liveliness_lease_ns), name_duration(asked.liveliness_lease_ns));
  expect(offered.ownership == asked.ownership, "ownership",
         name_kind(kOwnership, offered.ownership), name_kind(kOwnership, asked.ownership));
  expect(share_partition(offered.partitions, asked.partitions) ||
             share_partition(asked.partitions, offered.partitions),
         "partition", name_partitions(offered.partitions), name_partitions(asked.partitions));
  return found;
}

std::vector<Mismatch> find_policy_mismatches(const std::vector<Endpoint>& endpoints) {
  std::vector<Mismatch> found;
  std::set<std::pair<std::string, std::string>> said;
  for (const Endpoint& writer : endpoints)
    for (const Endpoint& reader : endpoints) {
      if (!writer.is_writer || reader.is_writer || writer.topic != reader.topic) continue;
      if (writer.participant == reader.participant) continue;
      for (Mismatch& mismatch : find_policy_mismatches(writer, reader))
        if (said.emplace(mismatch.topic, mismatch.policy).second)
          found.push_back(std::move(mismatch));
    }
  return found;
}

std::vector<Mismatch> find_type_mismatches(const std::vector<Endpoint>& endpoints) {
  std::vector<Mismatch> found;
  std::set<std::string> said;
  for (const Endpoint& one : endpoints)
    for (const Endpoint& other : endpoints) {
      if (one.topic != other.topic || &one >= &other) continue;
      const bool is_sized = one.max_size != 0 && other.max_size != 0;
      if (one.type != other.type && said.insert(one.topic).second)
        found.push_back(
            {one.topic, "type",
             one.owner + " has type " + one.type + ", " + other.owner + " has " + other.type});
      else if (one.type == other.type && is_sized && one.max_size != other.max_size &&
               said.insert(one.topic).second)
        found.push_back({one.topic, "type",
                         one.type + " of " + one.owner + " holds up to " +
                             std::to_string(one.max_size) + " bytes, that of " + other.owner +
                             " up to " + std::to_string(other.max_size) + ": another version"});
    }
  return found;
}

}  // namespace sls::doctor
