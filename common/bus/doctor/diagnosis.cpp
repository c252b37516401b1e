#include "common/bus/doctor/diagnosis.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <iomanip>
#include <set>
#include <sstream>

#include "common/bus/topics.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::bus::doctor {
namespace {

constexpr const char* kServer = "sim_server";
constexpr std::array<const char*, 4> kFlying = {kServer, "control_client", "recorder", "sim_ctl"};

/// More than the clocks of machines that are kept right differ, less than a command may be old.
constexpr std::chrono::nanoseconds kClockTolerance = std::chrono::milliseconds(100);
/// Where the delay of samples is all there is, which a busy machine adds to.
constexpr std::chrono::nanoseconds kDelayTolerance = std::chrono::seconds(1);

Check ok(const char* name, std::string text) { return {name, Verdict::kOk, std::move(text)}; }
Check fault(const char* name, std::string text) { return {name, Verdict::kFault, std::move(text)}; }
Check skipped(const char* name, std::string text) {
  return {name, Verdict::kSkipped, std::move(text)};
}

std::string name_megabytes(std::uint64_t bytes) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(bytes < 100'000'000 ? 1 : 0)
       << static_cast<double>(bytes) * 1e-6 << " MB";
  return text.str();
}

std::string name_seconds(std::chrono::nanoseconds time) {
  std::ostringstream text;
  text << std::setprecision(3) << std::chrono::duration<double>(std::chrono::abs(time)).count()
       << " s";
  return text.str();
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

std::string name_group(const Observations& seen) {
  return std::string(kMulticastGroup) + ":" + std::to_string(seen.settings.ports.multicast());
}

/// "UDP 7410 to 7429": the unicast ports of a domain that ten programs on a host use.
std::string name_ports(const Observations& seen) {
  const Ports& ports = seen.settings.ports;
  return "UDP " + std::to_string(ports.metatraffic(0)) + " to " +
         std::to_string(ports.user(kHighestProbeId));
}

bool is_any_heard(const Observations& seen) {
  return std::any_of(seen.heard.begin(), seen.heard.end(), [&](const Heard& heard) {
    return heard.domain == seen.domain && is_of_peer(seen, heard.address);
  });
}
bool is_any_discovered(const Observations& seen) {
  return std::any_of(seen.programs.begin(), seen.programs.end(),
                     [&](const Program& program) { return is_of_peer(seen, program); });
}
bool is_any_data(const Observations& seen) {
  return std::any_of(seen.echoes.begin(), seen.echoes.end(),
                     [](const auto& echo) { return echo.second; }) ||
         std::any_of(seen.programs.begin(), seen.programs.end(), [&](const Program& program) {
           return program.samples > 0 && is_of_peer(seen, program);
         });
}

// --- this machine --------------------------------------------------------------------------------

/// A program of this machine whose shared memory is not in our /dev/shm. The same port numbers may
/// be there, of this process itself: what counts is what was there before it joined.
const Program* find_unshared(const Observations& seen) {
  const auto& visible = seen.shared_memory.read_ports;
  const auto found =
      std::find_if(seen.programs.begin(), seen.programs.end(), [&](const Program& program) {
        const auto& ports = program.shared_memory_ports;
        if (program.name == kDoctorName) return false;  // ours, which has just started
        return program.is_on_this_host && program.samples == 0 && !ports.empty() &&
               std::none_of(ports.begin(), ports.end(), [&](std::uint32_t port) {
                 return std::find(visible.begin(), visible.end(), port) != visible.end();
               });
      });
  return found == seen.programs.end() ? nullptr : &*found;
}

Check check_shared_memory(const Observations& seen) {
  constexpr const char* kName = "shared memory";
  const SharedMemory& memory = seen.shared_memory;
  if (!seen.settings.uses_shared_memory) return skipped(kName, "this QoS file does not use it");
  if (!memory.is_there)
    return fault(
        kName, "/dev/shm is missing, or user " + seen.user +
                   " may not write there: no program can start: mount -t tmpfs tmpfs /dev/shm, or "
                   "use config/qos/udp.xml");
  const bool is_flying_here = std::any_of(
      seen.programs.begin(), seen.programs.end(),
      [](const Program& program) { return program.is_on_this_host && is_flying(program.name); });
  const std::uint64_t need = calc_shared_memory_need(seen.settings, is_flying_here ? 1 : 3);
  if (memory.free < need)
    return fault(kName, "/dev/shm has " + name_megabytes(memory.free) + " free of " +
                            name_megabytes(memory.size) + ", a flight needs " +
                            name_megabytes(need) +
                            ": programs would die of SIGBUS: mount -o remount,size=64M /dev/shm "
                            "(docker run --shm-size 64m), or use config/qos/udp.xml");
  if (const Program* program = find_unshared(seen))
    return fault(kName, name_program(*program) +
                            " runs on this host with another /dev/shm (a container of its own?): "
                            "nothing passes between the two: share it (docker run --ipc host), or "
                            "use config/qos/lan.xml");
  if (memory.stale_segments > 0)
    return fault(kName, std::to_string(memory.stale_segments) + " stale segments (" +
                            name_megabytes(memory.stale_size) + ") of killed processes of " +
                            join(memory.stale_owners) +
                            " fill /dev/shm: start any program of sls as that user, which removes "
                            "them, or run fastdds shm clean");
  return ok(kName, "/dev/shm has " + name_megabytes(memory.free) + " free, and nothing stale");
}

Check check_users(const Observations& seen) {
  constexpr const char* kName = "users";
  if (!seen.settings.uses_shared_memory)
    return skipped(kName, "they matter to shared memory alone, which this QoS file does not use");
  std::set<std::string> users = {seen.user};
  std::vector<std::string> others;
  for (const Program& program : seen.programs) {
    if (!program.is_on_this_host || program.shared_memory_ports.empty()) continue;
    if (program.user.empty() || !users.insert(program.user).second) continue;
    others.push_back(name_program(program) + " as " + config::to_printable(program.user));
  }
  if (others.empty()) return ok(kName, "everybody on this machine is " + seen.user);
  return fault(kName, join(others) + " and the doctor as " + seen.user +
                          ": users cannot open each other's shared memory, so nothing passes: run "
                          "all as one user, or use config/qos/udp.xml");
}

// --- the network ---------------------------------------------------------------------------------

Check check_network(const Observations& seen) {
  constexpr const char* kName = "network";
  const ProbeResults& probes = seen.probes;
  if (seen.peer_address.empty())
    return fault(kName, "'" + seen.peer +
                            "' has no IPv4 address: give one, or put the name into /etc/hosts");
  if (seen.settings.is_local() && !seen.is_peer_here)
    return fault(kName, seen.qos_file + " stays on " + join(seen.settings.only_addresses) +
                            ", so nothing reaches " + seen.peer +
                            ": use config/qos/lan.xml on every machine");
  if (!probes.is_tried && seen.peer.empty())
    return skipped(kName, "not tried, because joining would fail");
  if (probes.is_there() || seen.is_peer_up || is_any_heard(seen) || is_any_discovered(seen))
    return ok(kName, name_peer(seen) + " is reached" +
                         (seen.is_peer_here ? "" : " from " + probes.own_address));
  return fault(kName,
               seen.peer + (probes.is_unreachable ? " is unreachable" : " does not answer at all") +
                   ": the machine is down, the address is wrong, or there is no route: ping " +
                   seen.peer_address);
}

Check check_ports(const Observations& seen) {
  constexpr const char* kName = "ports";
  const ProbeResults& probes = seen.probes;
  if (!probes.is_tried) return skipped(kName, "not tried");
  const std::string open =
      ": open " + name_ports(seen) + " and " + std::to_string(seen.settings.ports.multicast());
  if (!probes.is_there() && !is_any_data(seen)) {
    if (!seen.is_peer_up && !is_any_heard(seen) && !is_any_discovered(seen))
      return skipped(kName, "nothing answers at " + name_peer(seen));
    return fault(kName, name_ports(seen) + " of " + name_peer(seen) +
                            " are blocked: the host is up, but neither answers nor refuses what is "
                            "sent there" +
                            open + " in its firewall");
  }
  if (probes.is_answered && !probes.is_answered_unasked && !is_any_data(seen))
    return fault(kName, name_ports(seen) + " of this machine are blocked: " + name_peer(seen) +
                            " answers, but what it sends by itself does not arrive" + open +
                            " in the firewall here");
  return ok(kName, name_peer(seen) +
                       (probes.is_answered  ? " answers on "
                        : probes.is_refused ? " lets through "
                                            : " takes part by ") +
                       name_ports(seen));
}

Check check_multicast(const Observations& seen) {
  constexpr const char* kName = "multicast";
  const ProbeResults& probes = seen.probes;
  if (!seen.settings.uses_multicast) return skipped(kName, "this QoS file does not use it");
  if (!probes.is_tried) return skipped(kName, "not tried");
  if (probes.is_multicast_answered)
    return ok(kName, "what is sent to " + name_group(seen) + " comes back from " + name_peer(seen));
  const std::string what_to_do =
      ": use config/qos/unicast.xml (SLS_PEERS), or allow IGMP and multicast on the switch and in "
      "the firewalls";
  if (probes.is_answered)
    return fault(kName, "nothing sent to " + name_group(seen) + " came back from " +
                            name_peer(seen) + ", which answers by unicast" + what_to_do);
  if (is_any_heard(seen)) return ok(kName, name_peer(seen) + " is heard on " + name_group(seen));
  if (!seen.peer.empty() && is_any_discovered(seen))
    return fault(kName, "nothing that " + seen.peer + " sends to " + name_group(seen) +
                            " arrives, though it is found by unicast" + what_to_do);
  return skipped(
      kName, "nobody at " + name_peer(seen) + " to try it with: start sls_doctor --answer there");
}

Check check_datagrams(const Observations& seen) {
  constexpr const char* kName = "datagrams";
  std::vector<std::string> lost, whole;
  for (const auto& [size, is_whole] : seen.probes.sizes)
    (is_whole ? whole : lost).push_back(std::to_string(size));
  if (whole.empty()) return skipped(kName, "nothing answers at " + name_peer(seen));
  if (lost.empty()) return ok(kName, join(whole) + " bytes pass");
  return fault(kName, join(lost) + " bytes do not pass, " + join(whole) +
                          " do: fragments are lost, and with them large samples (sls/parameters): "
                          "give all machines one MTU and let IP fragments through the firewall, or "
                          "set maxMessageSize 1400 in the QoS file's transport");
}

Check check_discovery(const Observations& seen) {
  constexpr const char* kName = "discovery";
  const auto& servers = seen.settings.discovery_servers;
  if (servers.empty()) return skipped(kName, "this QoS file needs no discovery server");
  if (!seen.programs.empty())
    return ok(kName, "the discovery server at " + join(servers) + " answers");
  return fault(kName, "no discovery server answers at " + join(servers) +
                          ": nobody finds anybody: start fast-discovery-server there, or correct "
                          "SLS_DISCOVERY_SERVER");
}

// --- the domain ----------------------------------------------------------------------------------

/// Names of our programs by domain, as announced by multicast and discovered.
std::map<int, std::set<std::string>> find_flying(const Observations& seen) {
  std::map<int, std::set<std::string>> flying;
  for (const Heard& heard : seen.heard)
    if (is_flying(heard.announcement.name) && is_of_peer(seen, heard.address))
      flying[heard.domain].insert(heard.announcement.name);
  for (const Program& program : seen.programs)
    if (is_flying(program.name) && is_of_peer(seen, program))
      flying[seen.domain].insert(program.name);
  return flying;
}

std::string list_flying(const std::set<std::string>& names) {
  return join({names.begin(), names.end()}) + (names.size() == 1 ? " is" : " are");
}

Check check_domain(const Observations& seen) {
  constexpr const char* kName = "domain";
  const std::string own = std::to_string(seen.domain);
  auto flying = find_flying(seen);
  const std::set<std::string> here = flying[seen.domain];
  flying.erase(seen.domain);
  for (const auto& [domain, names] : flying) {
    // A domain with a server may be a flight of its own; programs without one have lost theirs.
    const bool is_lost = here.empty() || (here.count(kServer) == 0) != (names.count(kServer) == 0);
    if (!is_lost) continue;
    const std::string other = std::to_string(domain);
    return fault(kName, list_flying(names) + " on domain " + other + ", and " +
                            (here.empty() ? "nobody is" : list_flying(here)) + " on domain " + own +
                            ": they never meet: start all with --domain " + other +
                            ", or all with --domain " + own);
  }
  if (!here.empty()) return ok(kName, list_flying(here) + " on domain " + own);
  if (!seen.peer.empty() && !seen.probes.is_there()) return skipped(kName, "nobody is heard");
  if (!seen.peer.empty() && !seen.is_peer_here && !seen.probes.is_answered)
    return fault(kName, "no program of sls is at " + seen.peer + " on domain " + own +
                            ": start it, or sls_doctor --answer there to try the way to it");
  return ok(kName, "no program of sls runs on any domain that is heard");
}

Check check_security(const Observations& seen) {
  constexpr const char* kName = "security";
  const bool is_secured = seen.settings.is_secured;
  const std::string file = seen.qos_file;
  if (!seen.join_error.empty() && is_secured)
    return fault(kName, seen.join_error +
                            ": correct SLS_KEYS and SLS_IDENTITY, or make keys with "
                            "./sls keys DIR");
  std::set<std::string> rejected, others;
  for (const Program& program : seen.programs) {
    // Who rejects us does not say so: he tells nothing of his writers and readers.
    const bool is_silent = is_secured && program.is_secured && is_flying(program.name) &&
                           !seen.is_met(program.id) && seen.probes.is_there();
    if (program.is_rejected || is_silent) rejected.insert(name_program(program));
    if (!program.is_rejected && program.is_secured != is_secured && is_flying(program.name))
      others.insert(name_program(program));
  }
  for (const Heard& heard : seen.heard)
    if (heard.domain == seen.domain && is_flying(heard.announcement.name) &&
        is_of_peer(seen, heard.address) && heard.announcement.is_secured != is_secured)
      others.insert(heard.announcement.name + " of " + heard.address);
  if (!others.empty())
    return fault(kName, join({others.begin(), others.end()}) +
                            (is_secured ? " without security, this QoS file with it"
                                        : " with security, this QoS file without it") +
                            ": they ignore each other: use config/qos/secure.xml with SLS_KEYS on "
                            "every machine, or on none");
  if (!rejected.empty())
    return fault(kName, join({rejected.begin(), rejected.end()}) +
                            " and the doctor reject each other: not the same authority, or an "
                            "identity that is not valid: give every machine keys of one ./sls keys "
                            "DIR, and see that they are not expired");
  return ok(kName, is_secured ? "everybody has a valid identity" : "nobody uses it");
}

// --- samples -------------------------------------------------------------------------------------

/// Theirs, each with the name of its program.
std::vector<Endpoint> name_owners(const Observations& seen) {
  std::vector<Endpoint> endpoints = seen.endpoints;
  for (Endpoint& endpoint : endpoints) {
    endpoint.owner = "a participant";
    for (const Program& program : seen.programs)
      if (program.id == endpoint.participant) endpoint.owner = name_program(program);
  }
  return endpoints;
}

std::vector<Endpoint> add_own(std::vector<Endpoint> endpoints, const Observations& seen) {
  endpoints.insert(endpoints.end(), seen.own_endpoints.begin(), seen.own_endpoints.end());
  return endpoints;
}

Check make_mismatch_check(const char* name, const std::vector<Mismatch>& found,
                          const std::string& what_to_do, const std::string& else_text) {
  if (found.empty()) return ok(name, else_text);
  std::vector<std::string> texts;
  for (const Mismatch& mismatch : found) texts.push_back(mismatch.topic + ": " + mismatch.text);
  return fault(name, join(texts) + ": these never match" + what_to_do);
}

Check check_types(const Observations& seen) {
  constexpr const char* kName = "types";
  if (!seen.is_joined) return skipped(kName, "not tried");
  return make_mismatch_check(kName, find_type_mismatches(add_own(name_owners(seen), seen)),
                             ": build all programs from one idl/sls.idl",
                             "the same for every topic");
}

Check check_qos(const Observations& seen) {
  constexpr const char* kName = "qos";
  if (!seen.is_joined) return skipped(kName, "not tried");
  const std::vector<Endpoint> theirs = name_owners(seen);
  std::vector<Mismatch> found = find_policy_mismatches(theirs);
  for (const Mismatch& mismatch : find_policy_mismatches(add_own(theirs, seen))) {
    // In real time the programs use other profiles for commands, with a deadline.
    if (mismatch.topic == Topic<ControlCommand>::kName && mismatch.policy == "deadline") continue;
    const bool is_known = std::any_of(found.begin(), found.end(), [&](const Mismatch& known) {
      return known.topic == mismatch.topic && known.policy == mismatch.policy;
    });
    if (!is_known) found.push_back(mismatch);
  }
  return make_mismatch_check(kName, found, ": use one QoS file for all programs",
                             "every writer matches every reader of its topic");
}

/// `is_explained`: another check has found a fault.
Check check_data(const Observations& seen, bool is_explained) {
  constexpr const char* kName = "data";
  const std::string cause =
      is_explained ? ": see the faults above"
                   : ": something between the two lets announcements pass and samples not: open " +
                         name_ports(seen) + " on both sides";
  if (!seen.join_error.empty() && !seen.settings.is_secured)
    return fault(kName, seen.join_error + ": no program can join with this QoS file");
  if (!seen.is_joined) return skipped(kName, "not tried, because joining would fail");
  if (!seen.other_end.empty())
    return fault(
        kName, "a second program of this machine died with " + seen.other_end + " when it joined");
  std::vector<std::string> silent, arrived;
  for (const Program& program : seen.programs) {
    if (program.is_expected && program.samples == 0) silent.push_back(name_program(program));
    if (program.samples > 0) arrived.push_back(name_program(program));
  }
  if (!silent.empty())
    return fault(kName,
                 "nothing that " + join(silent) + " wrote arrived, though discovered" + cause);
  const bool is_asked = seen.peer.empty() || seen.probes.is_answered;
  std::vector<std::string> lost;
  for (const auto& [size, is_back] : seen.echoes)
    if (!is_back && is_asked) lost.push_back(std::to_string(size));
  if (!lost.empty() && seen.refusal.empty())
    return fault(kName, "samples of " + join(lost) + " bytes did not come back from a doctor at " +
                            name_peer(seen) + cause);
  if (is_asked && seen.refusal.empty()) arrived.push_back("a doctor at " + name_peer(seen));
  if (arrived.empty()) return skipped(kName, "nobody to exchange samples with");
  return ok(kName, "samples arrive from " + join(arrived));
}

Check check_clock(const Observations& seen) {
  constexpr const char* kName = "clock";
  const std::string what_to_do =
      ": commands in real time are dropped as old (LIFESPAN), lockstep does not mind: keep both "
      "clocks right (chrony)";
  if (const auto ahead = seen.probes.clock_ahead; ahead && !seen.is_peer_here)
    return std::chrono::abs(*ahead) <= kClockTolerance
               ? ok(kName, "that of " + seen.peer + " agrees to " + name_seconds(*ahead))
               : fault(kName, "that of " + seen.peer + " is " + name_seconds(*ahead) +
                                  (ahead->count() > 0 ? " ahead" : " behind") + what_to_do);
  bool is_any = false;
  for (const Program& program : seen.programs) {
    if (!program.delay || program.is_on_this_host) continue;
    is_any = true;
    if (std::chrono::abs(*program.delay) > kDelayTolerance)
      return fault(kName, "that of " + name_program(program) + " is " +
                              name_seconds(*program.delay) +
                              (program.delay->count() < 0 ? " ahead" : " behind") + what_to_do);
  }
  return is_any ? ok(kName, "samples are as old as they may be")
                : skipped(kName, "no other machine to compare with");
}

}  // namespace

bool Observations::is_met(const PeerId& id) const {
  return std::any_of(endpoints.begin(), endpoints.end(),
                     [&](const Endpoint& endpoint) { return endpoint.participant == id; });
}

bool Observations::is_rejected(const PeerId& id) const {
  return std::any_of(programs.begin(), programs.end(), [&](const Program& program) {
    return program.id == id && program.is_rejected;
  });
}

bool is_flying(const std::string& name) {
  return std::find(kFlying.begin(), kFlying.end(), name) != kFlying.end();
}

std::uint64_t calc_shared_memory_need(const Settings& settings, int programs) {
  constexpr std::uint64_t kPerProgram = 1'000'000;  // bytes: its ports and bookkeeping
  return static_cast<std::uint64_t>(programs) * (settings.segment_size + kPerProgram);
}

std::vector<Check> diagnose(const Observations& seen) {
  std::vector<Check> checks = {
      check_shared_memory(seen), check_users(seen),     check_network(seen),   check_ports(seen),
      check_multicast(seen),     check_datagrams(seen), check_discovery(seen), check_domain(seen),
      check_security(seen),      check_types(seen),     check_qos(seen)};
  checks.push_back(check_data(seen, is_any_fault(checks)));
  checks.push_back(check_clock(seen));
  return checks;
}

}  // namespace sls::bus::doctor
