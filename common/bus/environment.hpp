/// What a program can know about its machine when it meets no other program, and the cause in it.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace sls::bus {

/// A sim_server, control_client or recorder that runs on this machine.
struct FlightProgram {
  std::string program, user;
  int process = 0;
  int domain = 0;
  std::string scenario;  ///< its file without folder and suffix; empty if not on the command line
};

/// Users with open UDP ports of RTPS participants in this network namespace, by domain.
using DomainUsers = std::map<int, std::set<uid_t>>;

/// Facts. The first group is given, `look_around` adds the others.
struct Environment {
  int domain = 0;
  int port_base = 7400, domain_gain = 250;  ///< of RTPS; domain d has port_base + d × domain_gain
  bool uses_shared_memory = false;
  bool is_local = false;  ///< the QoS file restricts the program to this machine
  bool is_alone = true;
  std::size_t participants = 1, most_participants = 64;  ///< on the domain, with this one
  std::set<std::string> addresses_at_start;

  std::string user;                    ///< of this process
  bool is_ros_server_ignored = false;  ///< ROS_DISCOVERY_SERVER was set
  std::string shared_memory_defect;
  std::size_t free_descriptors = 1000, most_descriptors = 1024;
  std::set<std::string> addresses;    ///< IPv4, of interfaces that are up
  std::set<std::string> other_users;  ///< with shared memory on this domain
  /// Other processes: servers first.
  std::vector<FlightProgram> programs;
  int free_domain = -1;  ///< without any participant on this machine; −1: none
};

Environment look_around(Environment given);

/// Why a program cannot work here, in one line; empty if it can.
std::string find_start_error(const Environment& seen);

/// The first known cause, with its cure, that keeps participants from finding each other; empty if
/// none is known.
std::string find_cause(const Environment& seen);

/// "a flight of 'hover' (root, sim_server, process 4711) is on domain 5; use --domain 6": a server
/// on this domain, or `is_elsewhere` a program of this user on another one, without advice; empty
/// if none.
std::string describe_other_flight(const Environment& seen, bool is_elsewhere = false);

/// Removes the variables of the environment that change what Fast DDS does. Only the file of --qos
/// counts.
void drop_foreign_variables();
bool is_ros_server_ignored();  ///< ROS_DISCOVERY_SERVER was set, now or when they were dropped

/// Why a program cannot put its shared memory into `folder`; empty if it can.
std::string find_shared_memory_defect(const std::filesystem::path& folder = "/dev/shm");

/// `table`: as the kernel writes /proc/net/udp.
DomainUsers find_domain_users(const Environment& given, const std::filesystem::path& table);

/// Programs in `processes`, a folder like /proc, whose user has a port open on their domain.
std::vector<FlightProgram> find_programs(const DomainUsers& users,
                                         const std::filesystem::path& processes);

}  // namespace sls::bus
