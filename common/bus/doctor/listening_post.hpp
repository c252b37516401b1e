/// Hears who announces himself by multicast, on every domain.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/doctor/announcement.hpp"
#include "common/bus/doctor/probe.hpp"
#include "common/bus/doctor/udp_socket.hpp"

namespace sls::bus::doctor {

struct Heard {
  int domain = 0;
  std::string address;  ///< whence it came
  Announcement announcement;
};

class ListeningPost {
 public:
  /// `ports` of any domain.
  explicit ListeningPost(Ports ports);
  /// Takes what has come.
  void work();
  /// Each participant once.
  std::vector<Heard> heard() const;

 private:
  std::vector<std::pair<int, UdpSocket>> sockets_;  ///< by domain
  std::map<std::pair<int, PeerId>, Heard> heard_;
  std::vector<unsigned char> buffer_;
};

}  // namespace sls::bus::doctor
