#include "common/bus/fastdds/discovered_participants.hpp"

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace sls::bus {

std::set<int> find_open_ports(const ParticipantPorts& ports, const std::filesystem::path& table) {
  std::set<int> open;
  std::ifstream lines(table);
  std::string line;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string number, local;  // "42:" and "0100007F:1CF2"
    words >> number >> local;
    const auto colon = local.find(':');
    if (colon == local.npos) continue;
    const int offset =
        static_cast<int>(std::strtol(local.c_str() + colon + 1, nullptr, 16)) - ports.base;
    if (offset >= 0 && offset % ports.gain == 0 && offset / ports.gain < kMaxParticipantIds)
      open.insert(ports.base + offset);
  }
  return open;
}

void DiscoveredParticipants::note(const PeerId& peer, const std::string& name,
                                  const std::set<int>& ports) {
  const std::lock_guard lock(mutex_);
  if (participants_.size() < kMost || participants_.count(peer) > 0)
    participants_[peer] = {name, ports};
}

void DiscoveredParticipants::drop(const PeerId& peer) {
  const std::lock_guard lock(mutex_);
  participants_.erase(peer);
}

std::set<PeerId> DiscoveredParticipants::find_named(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  std::set<PeerId> found;
  for (const auto& [peer, participant] : participants_)
    if (participant.name == name) found.insert(peer);
  return found;
}

std::set<int> DiscoveredParticipants::find_unknown(const std::set<int>& ports) const {
  const std::lock_guard lock(mutex_);
  std::set<int> unknown = ports;
  for (const auto& [peer, participant] : participants_)
    for (const int port : participant.ports) unknown.erase(port);
  return unknown;
}

}  // namespace sls::bus
