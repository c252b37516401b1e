// Checks of this machine and of the network, which carry the data.
#include <algorithm>
#include <iomanip>
#include <set>
#include <sstream>

#include "common/app/version.hpp"
#include "common/bus/environment.hpp"
#include "common/bus/node.hpp"
#include "common/config/yaml_node.hpp"
#include "tools/doctor/diagnosis_parts.hpp"

namespace sls::doctor {
namespace {

std::string name_megabytes(std::uint64_t bytes) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(bytes < 100'000'000 ? 1 : 0)
       << static_cast<double>(bytes) * 1e-6 << " MB";
  return text.str();
}

std::string name_group(const Observations& seen) {
  return std::string(kMulticastGroup) + ":" + std::to_string(seen.settings.ports.multicast());
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

/// A program of this machine whose shared memory is not in our /dev/shm. This process may use the
/// same port numbers, so only ports that existed before it joined count.
const Program* find_unshared(const Observations& seen) {
  const auto& visible = seen.shared_memory.read_ports;
  const auto found =
      std::find_if(seen.programs.begin(), seen.programs.end(), [&](const Program& program) {
        const auto& ports = program.shared_memory_ports;
        if (program.name == kDoctorName) return false;  // our second one, just started
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
    return finding(
        kName, "/dev/shm is missing, or user " + seen.user +
                   " may not write there: no program can start: mount -t tmpfs tmpfs /dev/shm, or "
                   "use config/qos/udp.xml");
  const bool is_flying_here = std::any_of(
      seen.programs.begin(), seen.programs.end(),
      [](const Program& program) { return program.is_on_this_host && is_flying(program.name); });
  const std::uint64_t need = calc_shared_memory_need(seen.settings, is_flying_here ? 1 : 3);
  if (memory.free < need)
    return finding(kName, "/dev/shm has " + name_megabytes(memory.free) + " free of " +
                              name_megabytes(memory.size) + ", a flight needs " +
                              name_megabytes(need) +
                              ": programs would die of SIGBUS: mount -o remount,size=64M /dev/shm "
                              "(docker run --shm-size 64m), or use config/qos/udp.xml");
  if (const Program* program = find_unshared(seen))
    return finding(kName,
                   name_program(*program) +
                       " runs on this host with another /dev/shm (a container of its own?): "
                       "nothing passes between the two: share it (docker run --ipc host), or "
                       "use config/qos/lan.xml");
  if (memory.stale_segments > 0)
    return finding(kName,
                   std::to_string(memory.stale_segments) + " stale segments (" +
                       name_megabytes(memory.stale_size) + ") of killed processes of " +
                       join(memory.stale_owners) +
                       " fill /dev/shm: start any program of sls as that user, which removes "
                       "them");
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
  if (others.empty()) return ok(kName, "all programs on this machine run as " + seen.user);
  return finding(kName,
                 join(others) + " and the doctor as " + seen.user +
                     ": users cannot open each other's shared memory, so nothing passes: run "
                     "all as one user, or use config/qos/udp.xml");
}

// --- the network ---------------------------------------------------------------------------------

Check check_network(const Observations& seen) {
  constexpr const char* kName = "network";
  const ProbeResults& probes = seen.probes;
  if (seen.peer_address.empty())
    return finding(kName, "'" + seen.peer +
                              "' has no IPv4 address: give one, or put the name into /etc/hosts");
  if (seen.settings.is_local() && !seen.is_peer_here)
    return finding(kName, seen.qos_file + " stays on " + join(seen.settings.only_addresses) +
                              ", so nothing reaches " + seen.peer +
                              ": use config/qos/lan.xml on every machine");
  if (!probes.is_tried && seen.peer.empty())
    return skipped(kName, "not tried, because joining would fail");
  if (probes.is_there() || seen.is_peer_up || is_any_heard(seen) || is_any_discovered(seen))
    return ok(kName, name_peer(seen) + " is reached" +
                         (seen.is_peer_here ? "" : " from " + probes.own_address));
  if (seen.peer.empty())
    return finding(kName, name_peer(seen) + " does not reach itself at " + seen.peer_address +
                              ": the interface is down: ip link set lo up");
  return finding(
      kName, seen.peer + (probes.is_unreachable ? " is unreachable" : " does not answer at all") +
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
    return finding(kName,
                   name_ports(seen) + " of " + name_peer(seen) +
                       " are blocked: the host is up, but neither answers nor refuses what is "
                       "sent there" +
                       open + " in its firewall");
  }
  if (probes.is_answered && !probes.is_answered_unasked && !is_any_data(seen))
    return finding(kName, name_ports(seen) + " of this machine are blocked: " + name_peer(seen) +
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
    return finding(kName, "nothing sent to " + name_group(seen) + " came back from " +
                              name_peer(seen) + ", which answers by unicast" + what_to_do);
  if (is_any_heard(seen)) return ok(kName, name_peer(seen) + " is heard on " + name_group(seen));
  if (!seen.peer.empty() && is_any_discovered(seen))
    return finding(kName, "nothing that " + seen.peer + " sends to " + name_group(seen) +
                              " arrives, though it is found by unicast" + what_to_do);
  return skipped(kName, "no program at " + name_peer(seen) +
                            " to try it with: start sls_doctor --answer there");
}

Check check_datagrams(const Observations& seen) {
  constexpr const char* kName = "datagrams";
  std::vector<std::string> lost, whole;
  for (const auto& [size, is_whole] : seen.probes.sizes)
    (is_whole ? whole : lost).push_back(std::to_string(size));
  if (whole.empty()) return skipped(kName, "nothing answers at " + name_peer(seen));
  if (lost.empty()) return ok(kName, join(whole) + " bytes pass");
  return finding(kName,
                 join(lost) + " bytes do not pass, " + join(whole) +
                     " do: fragments are lost, and with them large samples (sls/parameters): "
                     "give all machines one MTU and let IP fragments through the firewall, or "
                     "set maxMessageSize 1400 in the QoS file's transport");
}

Check check_discovery(const Observations& seen) {
  constexpr const char* kName = "discovery";
  const auto& servers = seen.settings.discovery_servers;
  if (servers.empty() && bus::is_ros_server_ignored())
    return ok(kName,
              "ROS_DISCOVERY_SERVER is set, and the programs ignore it: config/qos/"
              "discovery_server.xml with SLS_DISCOVERY_SERVER uses a discovery server");
  if (servers.empty()) return skipped(kName, "this QoS file needs no discovery server");
  if (!seen.programs.empty())
    return ok(kName, "the discovery server at " + join(servers) + " answers");
  return finding(kName,
                 "no discovery server answers at " + join(servers) +
                     ": no program finds another: start fast-discovery-server there, or correct "
                     "SLS_DISCOVERY_SERVER");
}

Check tell_versions() {
  return ok("versions", app::version() + " with Fast DDS " + bus::middleware_version() +
                            " and Eigen " + app::eigen_version() + " on " +
                            config::to_printable(app::system_name()));
}

}  // namespace

std::vector<Check> check_machine(const Observations& seen) {
  return {tell_versions(),       check_shared_memory(seen), check_users(seen),
          check_network(seen),   check_ports(seen),         check_multicast(seen),
          check_datagrams(seen), check_discovery(seen)};
}

}  // namespace sls::doctor
