/// Hosts and a network for tests, made of network namespaces.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/system/process.hpp"

namespace sls::test {

/// Hosts on one switch. Each host is a network namespace with loopback and one interface, `eth0`;
/// the switch is a bridge `br0` in its own namespace, with a port for each host, named like the
/// host. Addresses are 10.77.0.1, 10.77.0.2 … in the order of the names. The machine's own network
/// is not affected. The destructor removes everything; the next test removes the remains of a
/// killed test.
class Network {
 public:
  /// The switch, as a host name for the functions below.
  static constexpr const char* kSwitch = "switch";

  /// The reason why this machine cannot have such networks; empty if it can.
  static std::optional<std::string> find_obstacle();

  /// @throws std::runtime_error with the output of the failed command.
  explicit Network(const std::vector<std::string>& hosts);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  const std::string& address(const std::string& host) const { return addresses_.at(host); }

  /// Prefix that runs a command on `host`; the process keeps its id.
  std::vector<std::string> on(const std::string& host) const;

  /// Runs a shell command on `host` to its end, and returns its output.
  /// @throws std::runtime_error with the output if it fails.
  std::string run(const std::string& host, const std::string& command) const;

  // --- disturbances ------------------------------------------------------------------------------

  /// Drops this share of the IPv4 packets between hosts, at random, in each direction, in steps of
  /// 0.001. 0 ends it.
  void lose(double share) const;
  /// Packets lost by `lose` and `cut` so far.
  std::uint64_t lost() const;
  /// Drops all packets between hosts until `heal`, which also ends `lose`.
  void cut() const;
  void heal() const;
  /// Sets the largest packet of every link, in bytes without the Ethernet header.
  void set_mtu(int bytes) const;
  /// Limits the rate to and from each host, with a queue of 50 ms. Further packets are lost.
  void limit_rate(int kbit_per_s) const;
  /// Makes the switch drop multicast. Broadcasts pass, because hosts need them to resolve
  /// addresses.
  void block_multicast() const;

  struct WireFaults {
    double delay_ms = 0.0;
    double jitter_ms = 0.0;  ///< largest extra delay; packets overtake each other
    double duplicate_percent = 0.0;
    int seed = 1;
  };
  /// Puts a wire with faults in both directions between `host` and the switch (sls.check.wire).
  void disturb_wire(const std::string& host, const WireFaults& faults);
  /// Ends that wire and returns its output: "wire: 1000 frames, 52 duplicated, …".
  std::string end_wire(const std::string& host);

 private:
  std::string find_namespace(const std::string& host) const;
  void remove() const;

  const std::string prefix_;
  std::map<std::string, std::string> addresses_;
  std::map<std::string, std::unique_ptr<Process>> wires_;
};

}  // namespace sls::test
