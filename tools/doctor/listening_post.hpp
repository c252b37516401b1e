/// Listens for multicast announcements on every domain.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/fastdds/plain_announcements.hpp"
#include "tools/doctor/probe.hpp"
#include "tools/doctor/udp_socket.hpp"

namespace sls::doctor {

struct Heard {
  int domain = 0;
  std::string address;  ///< sender
  bus::PlainAnnouncement announcement;
};

class ListeningPost {
 public:
  /// Listens on all domains: `ports.domain` does not matter.
  explicit ListeningPost(Ports ports);
  /// Takes the announcements that have arrived.
  void work();
  /// The last announcement of each participant.
  std::vector<Heard> heard() const;

 private:
  std::vector<std::pair<int, UdpSocket>> sockets_;  ///< by domain
  std::map<std::pair<int, bus::PeerId>, Heard> heard_;
  std::vector<unsigned char> buffer_;
};

}  // namespace sls::doctor
