#include "tools/doctor/diagnosis_parts.hpp"

#include "common/config/yaml_node.hpp"

namespace sls::doctor {

Check ok(const char* name, std::string text) { return {name, Verdict::kOk, std::move(text)}; }
Check finding(const char* name, std::string text) {
  return {name, Verdict::kFinding, std::move(text)};
}
Check skipped(const char* name, std::string text) {
  return {name, Verdict::kSkipped, std::move(text)};
}

std::string name_program(const Program& program) {
  std::string name = program.name.empty() ? "a participant" : config::to_printable(program.name);
  if (!program.is_on_this_host && !program.address.empty()) name += " of " + program.address;
  return name;
}

bool is_of_peer(const Observations& seen, const std::string& address) {
  return seen.peer.empty() || address == seen.peer_address;
}
bool is_of_peer(const Observations& seen, const Program& program) {
  return seen.peer.empty() || program.address == seen.peer_address ||
         (seen.is_peer_here && program.is_on_this_host);
}

std::string name_peer(const Observations& seen) {
  return seen.peer.empty() ? "this machine" : seen.peer;
}

std::string name_ports(const Observations& seen) {
  const Ports& ports = seen.settings.ports;
  return "UDP " + std::to_string(ports.metatraffic(0)) + " to " +
         std::to_string(ports.user(kHighestProbeId));
}

}  // namespace sls::doctor
