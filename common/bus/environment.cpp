#include "common/bus/environment.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <pwd.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>  // join
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>

#include "common/bus/fastdds/discovered_participants.hpp"
#include "common/config/domain.hpp"
#include "common/config/yaml_node.hpp"
#include "fastdds_api.hpp"

namespace sls::bus {
namespace {

namespace fs = std::filesystem;

/// A participant takes 13 descriptors, and one or two for each other participant.
constexpr std::size_t kDescriptorsAtStart = 16, kDescriptorsLater = 2;
constexpr const char* kLoopback = "127.0.0.1";
constexpr const char* kServer = "sim_server";
constexpr const char* kRosServer = "ROS_DISCOVERY_SERVER";
std::atomic<bool> is_ros_server_dropped{false};

std::string read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;  // its operator catches: a process may end while its file is read
  text << stream.rdbuf();
  return text.str();
}

/// The value of `--name VALUE` or `--name=VALUE` among words that a zero ends each.
std::optional<std::string> find_option(const std::string& words, const std::string& name) {
  std::istringstream stream(words);
  for (std::string word; std::getline(stream, word, '\0');) {
    if (word == name && std::getline(stream, word, '\0')) return word;
    if (word.rfind(name + "=", 0) == 0) return word.substr(name.size() + 1);
  }
  return std::nullopt;
}

/// IPv4 addresses of the interfaces that are up.
std::set<std::string> find_addresses() {
  std::set<std::string> found;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) return found;
  for (const ifaddrs* item = first; item; item = item->ifa_next) {
    if (!item->ifa_addr || item->ifa_addr->sa_family != AF_INET || !(item->ifa_flags & IFF_UP))
      continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* address = reinterpret_cast<const sockaddr_in*>(item->ifa_addr);
    found.insert(::inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size()));
  }
  ::freeifaddrs(first);
  return found;
}

/// Free descriptors, counted without another one, up to those that a start needs.
std::size_t count_free_descriptors() {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  std::size_t free = 0;
  for (rlim_t i = 0; i < limit.rlim_cur && free < kDescriptorsAtStart; ++i)
    if (::fcntl(static_cast<int>(i), F_GETFD) < 0) ++free;
  return free;
}

/// The first of `programs` that `is_meant` accepts, in words; empty if it accepts none.
template <class IsMeant>
std::string describe_first(const Environment& seen, const IsMeant& is_meant) {
  const auto found = std::find_if(seen.programs.begin(), seen.programs.end(), is_meant);
  if (found == seen.programs.end()) return "";
  const std::string name =
      found->scenario.empty() ? "" : " of '" + config::to_printable(found->scenario) + "'";
  return fmt::format("a flight{} ({}, {}, process {}) is on domain {}", name, found->user,
                     found->program, found->process, found->domain);
}

std::string advise(const Environment& seen) {
  return seen.free_domain < 0 ? "" : "; use --domain " + std::to_string(seen.free_domain);
}

std::string describe_addresses(const Environment& seen) {
  if (seen.addresses.count(kLoopback) == 0)
    return "no interface that is up has 127.0.0.1: ip link set lo up";
  if (seen.is_alone && !seen.is_local && seen.addresses.size() == 1)
    return "no interface that is up has an IPv4 address besides 127.0.0.1: other machines are out "
           "of reach (ip address)";
  const bool is_changed = seen.is_local ? seen.addresses_at_start.count(kLoopback) == 0
                                        : seen.addresses != seen.addresses_at_start;
  return is_changed ? fmt::format(
                          "the addresses of this machine were '{}' when this program started "
                          "and are '{}' now: start it again",
                          fmt::join(seen.addresses_at_start, ", "), fmt::join(seen.addresses, ", "))
                    : "";
}

}  // namespace

std::string name_user(uid_t user) {
  const passwd* entry = ::getpwuid(user);
  return entry ? entry->pw_name : std::to_string(user);
}

void drop_foreign_variables() {
  if (is_ros_server_ignored()) is_ros_server_dropped = true;
  for (const char* name :
       {kProfilesVariable, kRosServer, "ROS_SUPER_CLIENT", "ROS2_EASY_MODE", "FASTDDS_STATISTICS",
        "FASTDDS_BUILTIN_TRANSPORTS", "FASTDDS_ENVIRONMENT_FILE"})
    ::unsetenv(name);
}

bool is_ros_server_ignored() {
  const char* value = std::getenv(kRosServer);
  return is_ros_server_dropped || (value && *value);
}

std::string find_shared_memory_defect(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    return std::strerror(error.value() != 0 ? error.value() : ENOTDIR);
  return ::access(folder.c_str(), W_OK | X_OK) == 0 ? "" : std::strerror(errno);
}

DomainUsers find_domain_users(const Environment& given, const fs::path& table) {
  DomainUsers users;
  for (const UdpPort& udp : read_udp_ports(table)) {
    const int offset = udp.port - given.port_base;
    if (offset >= 0 && offset / given.domain_gain <= config::kMaxDomain)
      users[offset / given.domain_gain].insert(udp.user);
  }
  return users;
}

std::vector<FlightProgram> find_programs(const DomainUsers& users, const fs::path& processes) {
  std::vector<FlightProgram> programs;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(processes, error)) {
    FlightProgram found;
    found.process = std::atoi(entry.path().filename().c_str());
    if (found.process <= 0 || found.process == ::getpid()) continue;
    found.program = read(entry.path() / "comm");
    found.program.erase(std::min(found.program.find('\n'), found.program.size()));
    struct stat status {};
    if (found.program != kServer && found.program != "control_client" &&
        found.program != "recorder")
      continue;
    if (::stat(entry.path().c_str(), &status) != 0) continue;
    found.user = name_user(status.st_uid);
    const std::string words = read(entry.path() / "cmdline");
    found.scenario = fs::path(find_option(words, "--scenario").value_or("")).stem();
    auto domain = find_option(words, "--domain");
    if (!domain) domain = find_option(read(entry.path() / "environ"), "SLS_DOMAIN");
    found.domain = std::atoi(domain.value_or("0").c_str());
    const auto is_there = [&](const auto& item) { return item.second.count(status.st_uid) > 0; };
    // The variables of another user are not readable: of his domains the first.
    auto place = users.find(found.domain);
    if (!domain && (place == users.end() || !is_there(*place)))
      place = std::find_if(users.begin(), users.end(), is_there);
    if (place == users.end() || !is_there(*place)) continue;
    found.domain = place->first;
    programs.insert(found.program == kServer ? programs.begin() : programs.end(), found);
  }
  return programs;
}

Environment look_around(Environment seen) {
  seen.user = name_user(::geteuid());
  seen.is_ros_server_ignored = is_ros_server_ignored();
  seen.shared_memory_defect = find_shared_memory_defect();
  seen.free_descriptors = count_free_descriptors();
  seen.addresses = find_addresses();
  const DomainUsers users = find_domain_users(seen, "/proc/net/udp");
  seen.programs = find_programs(users, "/proc");
  for (int i = 1; i <= config::kMaxDomain && seen.free_domain < 0; ++i)
    if (const int domain = (seen.domain + i) % (config::kMaxDomain + 1); users.count(domain) == 0)
      seen.free_domain = domain;
  return seen;
}

std::string find_cause(const Environment& seen, bool is_start) {
  if (!is_start && seen.is_alone && !seen.is_local && seen.is_ros_server_ignored)
    return "ROS_DISCOVERY_SERVER is ignored: --qos config/qos/discovery_server.xml with "
           "SLS_DISCOVERY_SERVER uses a discovery server";
  if (seen.uses_shared_memory && !seen.shared_memory_defect.empty())
    return "/dev/shm: expected a folder that this user can write to, got '" +
           seen.shared_memory_defect +
           "': mount -t tmpfs tmpfs /dev/shm, or --qos config/qos/udp.xml";
  const std::size_t needed = is_start ? kDescriptorsAtStart : kDescriptorsLater;
  if (seen.free_descriptors < needed)
    return fmt::format(
        "expected {} free file descriptors at least, got {} (EMFILE): ulimit -n 1024", needed,
        seen.free_descriptors);
  if (const std::string text = describe_addresses(seen); !is_start && !text.empty()) return text;
  if (seen.participants >= seen.most_participants)
    return fmt::format("domain {} has {} participants, the most that are heard (ROS 2 counts)",
                       seen.domain, seen.participants) +
           advise(seen);
  const std::string flight = describe_first(seen, [&](const FlightProgram& program) {
    return program.domain == seen.domain && program.user != seen.user && seen.uses_shared_memory;
  });
  return flight.empty()
             ? ""
             : flight + advise(seen) +
                   " (users share no memory: to join it, --qos config/qos/udp.xml for all)";
}

std::string describe_other_flight(const Environment& seen, bool is_elsewhere) {
  const std::string text = describe_first(seen, [&](const FlightProgram& program) {
    return is_elsewhere ? program.domain != seen.domain && program.user == seen.user
                        : program.domain == seen.domain && program.program == kServer;
  });
  return text.empty() || is_elsewhere ? text : text + advise(seen);
}

}  // namespace sls::bus
