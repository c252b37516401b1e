/// Listens for multicast announcements on every domain.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tools/doctor/announcement.hpp"
#include "tools/doctor/probe.hpp"
#include "tools/doctor/udp_socket.hpp"

namespace sls::doctor {

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
  std::map<std::pair<int, bus::PeerId>, Heard> heard_;
  std::vector<unsigned char> buffer_;
};

}  // namespace sls::doctor
