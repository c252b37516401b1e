/// Shared by the checks of diagnosis.hpp: verdicts, texts for programs, host and ports, and the
/// test whether a program runs on the peer.
#pragma once

#include <string>

#include "tools/doctor/diagnosis.hpp"

namespace sls::doctor {

Check ok(const char* name, std::string text);
Check finding(const char* name, std::string text);
Check skipped(const char* name, std::string text);

/// "recorder of 10.77.0.3"; without the address if it runs on this host.
std::string name_program(const Program& program);
/// The peer as the user gave it; "this machine" if there is none.
std::string name_peer(const Observations& seen);
/// "UDP 7410 to 7429": the unicast ports of a domain that ten programs on a host use.
std::string name_ports(const Observations& seen);

/// True if the address or program is the peer's; always true if the user gave no peer.
bool is_of_peer(const Observations& seen, const std::string& address);
bool is_of_peer(const Observations& seen, const Program& program);

/// Versions, shared memory, users, network, ports, multicast, datagrams, discovery: machine_checks.cpp.
std::vector<Check> check_machine(const Observations& seen);
/// Domain, security, types, QoS, data, clock: domain_checks.cpp. `is_explained`: a check of the
/// machine has a finding, which explains missing data.
std::vector<Check> check_domain(const Observations& seen, bool is_explained);

}  // namespace sls::doctor
