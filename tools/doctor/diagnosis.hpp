/// From what was seen to what is wrong: no network, no middleware.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/doctor/check.hpp"
#include "tools/doctor/endpoint.hpp"
#include "tools/doctor/listening_post.hpp"
#include "tools/doctor/observer.hpp"
#include "tools/doctor/probe.hpp"
#include "tools/doctor/settings.hpp"
#include "tools/doctor/shared_memory.hpp"

namespace sls::doctor {

struct Observations {
  std::string qos_file;
  int domain = 0;
  std::string user;          ///< whose process this is
  std::string peer;          ///< as asked for; empty: this machine
  std::string peer_address;  ///< empty if the name has none
  bool is_peer_here = true;  ///< the address is one of this machine
  bool is_peer_up = false;   ///< by TCP

  Settings settings;
  SharedMemory shared_memory;  ///< before this process joined
  ProbeResults probes;
  std::vector<Heard> heard;

  bool is_joined = false;
  std::string join_error;  ///< why not; empty if it was not tried
  std::string other_end;   ///< how the other end on this machine died; empty: it did not
  std::string refusal;     ///< why there is no doctor's topic
  std::vector<Program> programs;
  std::vector<Endpoint> endpoints;      ///< theirs
  std::vector<Endpoint> own_endpoints;  ///< of the QoS file
  std::map<std::uint32_t, bool> echoes;

  /// A writer or reader of that participant is known.
  bool is_met(const bus::PeerId& id) const;
  /// DDS Security keeps it out.
  bool is_rejected(const bus::PeerId& id) const;
};

/// Room in /dev/shm that `programs` more programs need, bytes.
std::uint64_t calc_shared_memory_need(const Settings& settings, int programs);

/// True for a name that one of our programs gives its participant, the doctor's apart.
bool is_flying(const std::string& name);

/// One line per check, in the order in which to read them.
std::vector<Check> diagnose(const Observations& seen);

}  // namespace sls::doctor
