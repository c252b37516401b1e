/// Hosts and a network for tests, out of network namespaces.
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
/// the switch is a bridge `br0` in a namespace of its own, with a port for each host, named like
/// the host. Addresses are 10.77.0.1, 10.77.0.2 … in the order of the names. Nothing of this
/// reaches the machine's own network. It is removed with the object; what a killed test left, by
/// the next one.
class Network {
 public:
  /// The name of the switch where a host's is expected.
  static constexpr const char* kSwitch = "switch";

  /// Why this machine cannot have such networks; empty if it can.
  static std::optional<std::string> find_obstacle();

  /// @throws std::runtime_error with what the system said.
  explicit Network(const std::vector<std::string>& hosts);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  const std::string& address(const std::string& host) const { return addresses_.at(host); }

  /// Prefix that runs a command on `host`; the process keeps its id.
  std::vector<std::string> on(const std::string& host) const;

  /// Runs a shell command on `host` to its end, and returns what it printed.
  /// @throws std::runtime_error with that if it fails.
  std::string run(const std::string& host, const std::string& command) const;

  // --- disturbances ------------------------------------------------------------------------------

  /// Of the IPv4 packets between hosts so many are lost, at random, each way. 0 ends it.
  void lose(int percent) const;
  /// Packets lost by `lose` and `cut` so far.
  std::uint64_t lost() const;
  /// Nothing passes between hosts until `heal`, which also ends `lose`.
  void cut() const;
  void heal() const;
  /// Bytes per packet on every link, without the Ethernet header.
  void set_mtu(int bytes) const;
  /// So much goes to, and so much comes from, each host; a queue of 50 ms, then loss.
  void limit_rate(int kbit_per_s) const;
  /// The switch forwards no multicast (broadcasts pass: hosts find each other's addresses).
  void block_multicast() const;

  struct WireFaults {
    double delay_ms = 0.0;
    double jitter_ms = 0.0;  ///< up to so much more; packets overtake each other
    double duplicate_percent = 0.0;
    int seed = 1;
  };
  /// Puts a wire with faults, each way, between `host` and the switch (frame_relay.cpp).
  void disturb_wire(const std::string& host, const WireFaults& faults);
  /// Ends that wire; what it did, in words: "frame_relay: 1000 frames, 52 duplicated, …".
  std::string end_wire(const std::string& host);

 private:
  std::string find_namespace(const std::string& host) const;
  void remove() const;

  const std::string prefix_;
  std::map<std::string, std::string> addresses_;
  std::map<std::string, std::unique_ptr<Process>> wires_;
};

}  // namespace sls::test
