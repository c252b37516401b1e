/// Derives the checks, with their findings, from observations: no network, no middleware.
#pragma once

#include <cstdint>
#include <map>
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
  std::string user;          ///< user of this process
  std::string peer;          ///< as the user gave it; empty: this machine
  std::string peer_address;  ///< empty if the name has none
  bool is_peer_here = true;  ///< the address is one of this machine
  bool is_peer_up = false;   ///< accepts or refuses a TCP connection

  Settings settings;
  SharedMemory shared_memory;  ///< before this process joined
  ProbeResults probes;
  std::vector<Heard> heard;

  bool is_joined = false;
  std::string join_error;  ///< why joining failed; empty if it did not fail or was not tried
  std::string other_end;   ///< how the second doctor on this machine died; empty: it runs
  std::string refusal;     ///< why Fast DDS refused the doctor's topic; empty: it did not
  std::vector<Program> programs;
  std::vector<Endpoint> endpoints;      ///< discovered
  std::vector<Endpoint> own_endpoints;  ///< made from the QoS file
  std::map<std::uint32_t, bool> echoes;

  /// True if a writer or reader of that participant was discovered.
  bool is_met(const bus::PeerId& id) const;
  /// True if DDS Security rejected it.
  bool is_rejected(const bus::PeerId& id) const;
};

/// Room in /dev/shm that `programs` more programs need, bytes.
std::uint64_t calc_shared_memory_need(const Settings& settings, int programs);

/// True for the participant names of sim_server, control_client, recorder, sim_ctl and sls_view.
bool is_flying(const std::string& name);

/// One line per check, in the order in which to read them.
std::vector<Check> diagnose(const Observations& seen);

}  // namespace sls::doctor
