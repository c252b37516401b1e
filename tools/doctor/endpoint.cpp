#include "tools/doctor/endpoint.hpp"

#include <set>
#include <utility>

namespace sls::doctor {
std::vector<Mismatch> find_policy_mismatches(const std::vector<Endpoint>& endpoints) {
  std::vector<Mismatch> found;
  std::set<std::pair<std::string, std::string>> said;
  for (const Endpoint& writer : endpoints)
    for (const Endpoint& reader : endpoints) {
      if (!writer.is_writer || reader.is_writer || writer.topic != reader.topic) continue;
      if (writer.participant == reader.participant) continue;
      for (const auto& [policy, text] : bus::find_mismatches(writer, reader))
        if (said.emplace(writer.topic, policy).second)
          found.push_back(
              {writer.topic, policy, text + " (" + writer.owner + ", " + reader.owner + ")"});
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
