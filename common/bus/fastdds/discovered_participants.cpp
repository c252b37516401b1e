#include "common/bus/fastdds/discovered_participants.hpp"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

namespace sls::bus {

std::vector<UdpPort> read_udp_ports(const std::filesystem::path& table) {
  std::vector<UdpPort> found;
  std::ifstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream stream(line);  // "42: 0100007F:1CF2 …", the user is the eighth word
    const std::vector<std::string> words(std::istream_iterator<std::string>(stream), {});
    const auto colon = words.size() < 8 ? std::string::npos : words[1].find(':');
    if (colon == std::string::npos) continue;
    found.push_back({static_cast<int>(std::strtol(words[1].c_str() + colon + 1, nullptr, 16)),
                     static_cast<uid_t>(std::strtoul(words[7].c_str(), nullptr, 10))});
  }
  return found;
}

std::set<int> find_open_ports(const ParticipantPorts& ports, const std::filesystem::path& table) {
  std::set<int> open;
  for (const UdpPort& udp : read_udp_ports(table)) {
    const int offset = udp.port - ports.base;
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
