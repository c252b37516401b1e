/// The multicast announcement of a DDS participant of any vendor (RTPS 2.x, SPDP).
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "common/bus/peer.hpp"

namespace sls::doctor {

struct Announcement {
  bus::PeerId id;
  std::string name;         ///< "sim_server"; empty if it has none
  bool is_secured = false;  ///< carries an identity: DDS Security
};

/// The announcement in an RTPS message of `size` bytes; nothing if it holds none, or is damaged.
std::optional<Announcement> parse_announcement(const unsigned char* message, std::size_t size);

}  // namespace sls::doctor
