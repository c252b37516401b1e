#include "tools/doctor/listening_post.hpp"

#include <limits>

#include "common/config/domain.hpp"

namespace sls::doctor {

ListeningPost::ListeningPost(Ports ports) {
  const auto interfaces = find_interfaces();
  for (ports.domain = 0; ports.domain <= config::kMaxDomain; ++ports.domain) {
    if (ports.multicast() > std::numeric_limits<std::uint16_t>::max()) break;
    UdpSocket socket;
    if (!socket.bind(kMulticastGroup, ports.multicast(), true)) continue;  // the port is not shared
    // One socket is enough: the kernel delivers a joined group to all sockets (IP_MULTICAST_ALL).
    if (sockets_.empty()) socket.join(kMulticastGroup, interfaces);
    sockets_.emplace_back(ports.domain, std::move(socket));
  }
}

void ListeningPost::work() {
  for (auto& [domain, socket] : sockets_)
    while (const auto received = socket.receive(buffer_))
      if (auto found = bus::find_announcement(buffer_.data(), received->size);
          found && !found->is_leaving) {
        const auto key = std::make_pair(domain, found->sender);
        heard_[key] = {domain, to_string(received->sender.sin_addr), std::move(*found)};
      }
}

std::vector<Heard> ListeningPost::heard() const {
  std::vector<Heard> all;
  for (const auto& [key, heard] : heard_) all.push_back(heard);
  return all;
}

}  // namespace sls::doctor
