#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/peer.hpp"

namespace sls::bus {

/// The plain announcement of a participant.
///
/// Fast DDS 2.10.3, 2.11.3, 2.12.2, 2.13 and later, 3 among them, discovers a secured participant
/// only through a second announcement, sent by a secure writer after the authentication
/// (PDPSimple::assignRemoteEndpoints of 3.1.2). So it does not tell the name of one that it refuses. Earlier versions announce that
/// writer (PDP.cpp of 2.9.1, line 255), but do not have it: a secured flight needs one version.
/// Cyclone DDS 0.10 has it, but writes nothing with it (README.md, trap 38).
///
/// Upstream: none reported. `as_secure` is to be deleted with the support of Cyclone DDS, the rest
/// with refusals.hpp.
struct PlainAnnouncement {
  std::string name;                    ///< of the participant; it chooses it
  std::string version;                 ///< of its Fast DDS, if it is a program of ours; else empty
  std::string process;                 ///< its process, if it is a program of ours; else empty
  std::string certificate, authority;  ///< subjects, if it is a program of ours; else empty
  bool is_secured = false;             ///< it announces an identity
  bool is_leaving = false;             ///< it only says that it leaves
  PeerId sender;
  /// Of Cyclone DDS: the same message as if the secure writer had sent it. A reader that requires a
  /// protected one or has not authenticated the participant drops it.
  std::vector<std::uint8_t> as_secure;
};

/// The announcement in an RTPS message, if that is what the message contains. Malformed messages
/// contain none.
std::optional<PlainAnnouncement> find_announcement(const std::uint8_t* message, std::size_t size);

/// True if this version of Fast DDS, such as "2.9.1", has the secure writer.
bool has_secure_announcements(const std::string& version);

}  // namespace sls::bus
