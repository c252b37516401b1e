/// Which participants discovery has found, and whether it has found all that this machine runs.
/// Upstream: none reported, the middleware does not say when discovery is complete. To be deleted
/// when it does.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "common/bus/fastdds/stale_segments.hpp"
#include "common/bus/peer.hpp"

namespace sls::bus {

/// A UDP socket in this network namespace.
struct UdpPort {
  int port = 0;
  uid_t user = 0;  ///< its owner
};

/// The UDP sockets in `table`, as the kernel writes it. Empty if it cannot be read.
std::vector<UdpPort> read_udp_ports(const std::filesystem::path& table);

/// Ports of participants (of `ports`, without the number after each) at which a UDP socket is open
/// in this network namespace. `table`: as the kernel writes it. Empty if it cannot be read.
std::set<int> find_open_ports(const ParticipantPorts& ports,
                              const std::filesystem::path& table = "/proc/net/udp");

class DiscoveredParticipants {
 public:
  static constexpr std::size_t kMost = 1000;

  /// `ports`: at which the participant receives discovery data.
  void note(const PeerId& peer, const std::string& name, const std::set<int>& ports);
  void drop(const PeerId& peer);

  /// Present participants with this name.
  std::set<PeerId> find_named(const std::string& name) const;

  /// Those of `ports` that no present participant has.
  std::set<int> find_unknown(const std::set<int>& ports) const;

 private:
  struct Participant {
    std::string name;
    std::set<int> ports;
  };

  mutable std::mutex mutex_;
  std::map<PeerId, Participant> participants_;
};

}  // namespace sls::bus
