/// Hosts and a network for tests, out of network namespaces.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace sls::test {

/// Hosts on one switch. Each host is a network namespace with loopback and one interface, `eth0`; the
/// switch is a bridge `br0` in a namespace of its own, with a port for each host, named like the host.
/// Addresses are 10.77.0.1, 10.77.0.2 … in the order of the names. Nothing of this reaches the
/// machine's own network. It is removed with the object; what a killed test left, by the next one.
class Network {
 public:
  /// The name of the switch where a host's is expected.
  static constexpr const char* kSwitch = "switch";

  /// What keeps this machine from having such networks; nothing where they work.
  static std::optional<std::string> find_obstacle();

  /// @throws std::runtime_error with what the system said.
  explicit Network(const std::vector<std::string>& hosts);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  const std::string& address(const std::string& host) const { return addresses_.at(host); }

  /// What runs a command on `host` when put before it; the process keeps its id.
  std::vector<std::string> on(const std::string& host) const;

  /// Runs a shell command on `host` to its end, and returns what it printed.
  /// @throws std::runtime_error with that if it fails.
  std::string run(const std::string& host, const std::string& command) const;

 private:
  std::string find_namespace(const std::string& host) const;
  void remove() const;

  const std::string prefix_;
  std::map<std::string, std::string> addresses_;
};

}  // namespace sls::test
