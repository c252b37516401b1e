#include "tools/doctor/diagnosis.hpp"

#include <algorithm>
#include <array>

#include "common/bus/fastdds/stale_segments.hpp"
#include "common/config/yaml_node.hpp"
#include "tools/doctor/diagnosis_parts.hpp"

namespace sls::doctor {
namespace {

constexpr std::array<const char*, 5> kFlying = {"sim_server", "control_client", "recorder",
                                                "sim_ctl", "sls_view"};

}  // namespace

bool Observations::is_met(const bus::PeerId& id) const {
  return std::any_of(endpoints.begin(), endpoints.end(),
                     [&](const Endpoint& endpoint) { return endpoint.participant == id; });
}

bool Observations::is_rejected(const bus::PeerId& id) const {
  return std::any_of(programs.begin(), programs.end(), [&](const Program& program) {
    return program.id == id && program.is_rejected;
  });
}

bool is_flying(const std::string& name) {
  return std::find(kFlying.begin(), kFlying.end(), name) != kFlying.end();
}

std::uint64_t calc_shared_memory_need(const Settings& settings, int programs) {
  // Bytes: its ports and bookkeeping, and what it shares of the loop.
  constexpr std::uint64_t kPerProgram = 1'000'000 + bus::kMostSharedData;
  return static_cast<std::uint64_t>(programs) * (settings.segment_size + kPerProgram);
}

std::vector<Check> diagnose(const Observations& seen) {
  std::vector<Check> checks = check_machine(seen);
  const std::vector<Check> further = check_domain(seen, has_finding(checks));
  checks.insert(checks.end(), further.begin(), further.end());
  return checks;
}

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
