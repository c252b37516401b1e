/// What this machine tells about why a program meets no other, and the first cause among it.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace sls::bus {

/// A sim_server, control_client or recorder on this machine.
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

  std::string user;  ///< of this process
  bool is_ros_server_ignored = false;
  std::string shared_memory_defect;
  std::size_t free_descriptors = 1024;
  std::set<std::string> addresses;      ///< IPv4, of interfaces that are up
  std::vector<FlightProgram> programs;  ///< of other processes; servers first
  int free_domain = -1;                 ///< without participants on this machine; −1: none
};

Environment look_around(Environment given);

/// The first known cause, with its cure, why participants do not meet; empty if none is known. With
/// `is_start`: why a program that starts now cannot fly.
std::string find_cause(const Environment& seen, bool is_start = false);

/// "a flight of 'hover' (root, sim_server, process 4711) is on domain 5; use --domain 6": a server
/// on this domain. With `is_elsewhere` a program of this user on another one, without advice.
std::string describe_other_flight(const Environment& seen, bool is_elsewhere = false);

/// The name of a user, or the number of one without a name.
std::string name_user(uid_t user);

/// Removes the variables of the environment that change what Fast DDS does: only --qos counts.
void drop_foreign_variables();
/// True if ROS_DISCOVERY_SERVER is set, or was when it was dropped.
bool is_ros_server_ignored();

/// Why a program cannot put its shared memory into `folder`; empty if it can.
std::string find_shared_memory_defect(const std::filesystem::path& folder = "/dev/shm");

/// `table`: as the kernel writes /proc/net/udp.
DomainUsers find_domain_users(const Environment& given, const std::filesystem::path& table);

/// Programs in `processes`, a folder like /proc, whose user has a port open on their domain.
std::vector<FlightProgram> find_programs(const DomainUsers& users,
                                         const std::filesystem::path& processes);

}  // namespace sls::bus
