#include "tests/network/network.hpp"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace sls::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNamespaces = "/run/netns";
const std::string kOurs = "sls-test-";

std::string run_shell(const std::string& command) {
  FILE* pipe = ::popen(("{ " + command + "; } 2>&1").c_str(), "r");
  if (!pipe) throw std::runtime_error(command + ": cannot start");
  std::string output;
  std::array<char, 4096> part;
  while (const std::size_t count = std::fread(part.data(), 1, part.size(), pipe))
    output.append(part.data(), count);
  const int status = ::pclose(pipe);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error(command + ": " + output);
  return output;
}

/// Removes the namespaces of tests whose process no longer runs.
void remove_what_killed_tests_left() {
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(kNamespaces, none)) {
    const std::string name = entry.path().filename();
    if (name.rfind(kOurs, 0) != 0) continue;
    const pid_t owner = std::atoi(name.c_str() + kOurs.size());
    if (owner > 0 && ::kill(owner, 0) != 0 && errno == ESRCH)
      run_shell("ip netns delete " + name + " || true");
  }
}

std::string make_prefix() {
  static std::atomic<int> count{0};
  return kOurs + std::to_string(::getpid()) + "-" + std::to_string(count++) + "-";
}

}  // namespace

std::optional<std::string> Network::find_obstacle() {
  if (::geteuid() != 0) return "network namespaces need root";
  try {
    Network({"probe"});
  } catch (const std::runtime_error& error) {
    return std::string("no network namespaces here: ") + error.what();
  }
  return std::nullopt;
}

Network::Network(const std::vector<std::string>& hosts) : prefix_(make_prefix()) {
  remove_what_killed_tests_left();
  try {
    run_shell("ip netns add " + find_namespace(kSwitch));
    run(kSwitch, "ip link add br0 type bridge && ip link set br0 up");
    for (const std::string& host : hosts) {
      const std::string address = "10.77.0." + std::to_string(addresses_.size() + 1);
      addresses_[host] = address;
      run_shell("ip netns add " + find_namespace(host));
      run(kSwitch, "ip link add " + host + " type veth peer name eth0 netns " +
                       find_namespace(host) + " && ip link set " + host + " master br0 up");
      run(host,
          "ip link set lo up && ip address add " + address + "/24 dev eth0 && ip link set eth0 up");
    }
  } catch (...) {
    remove();
    throw;
  }
}

Network::~Network() {
  wires_.clear();
  remove();
}

void Network::remove() const {
  try {
    for (const auto& [host, address] : addresses_)
      run_shell("ip netns delete " + find_namespace(host) + " || true");
    run_shell("ip netns delete " + find_namespace(kSwitch) + " || true");
  } catch (const std::runtime_error& error) {
    std::fprintf(stderr, "%s\n", error.what());
  }
}

std::string Network::find_namespace(const std::string& host) const { return prefix_ + host; }

std::vector<std::string> Network::on(const std::string& host) const {
  return {"/usr/sbin/ip", "netns", "exec", find_namespace(host)};
}

std::string Network::run(const std::string& host, const std::string& command) const {
  std::string quoted;
  for (const char letter : command)
    quoted += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
  return run_shell("ip netns exec " + find_namespace(host) + " sh -c '" + quoted + "'");
}

// --- disturbances --------------------------------------------------------------------------------

void Network::lose(double share) const {
  heal();
  const long per_mille = std::lround(share * 1000);
  if (per_mille > 0)
    run(kSwitch,
        "nft 'add table bridge wire; add chain bridge wire f { type filter hook forward "
        "priority 0; }; add rule bridge wire f ether type ip numgen random mod 1000 < " +
            std::to_string(per_mille) + " counter drop'");
}

void Network::cut() const {
  heal();
  run(kSwitch,
      "nft 'add table bridge wire; add chain bridge wire f { type filter hook forward "
      "priority 0; }; add rule bridge wire f counter drop'");
}

void Network::heal() const { run(kSwitch, "nft flush ruleset"); }

std::uint64_t Network::lost() const {
  const std::string rules = run(kSwitch, "nft list ruleset");
  const std::string before = "counter packets ";
  const auto at = rules.find(before);
  return at == rules.npos ? 0 : std::stoull(rules.substr(at + before.size()));
}

void Network::set_mtu(int bytes) const {
  const std::string mtu = " mtu " + std::to_string(bytes);
  for (const auto& [host, address] : addresses_) {
    run(kSwitch, "ip link set " + host + mtu);
    run(host, "ip link set eth0" + mtu);
  }
}

void Network::limit_rate(int kbit_per_s) const {
  // A burst of two large packets only: the limit then acts on the queue, not on the bucket.
  const std::string limit =
      " root tbf burst 4kb latency 50ms rate " + std::to_string(kbit_per_s) + "kbit";
  for (const auto& [host, address] : addresses_) {
    run(kSwitch, "tc qdisc add dev " + host + limit);
    run(host, "tc qdisc add dev eth0" + limit);
  }
}

void Network::block_multicast() const {
  run(kSwitch, "ip link set br0 type bridge mcast_snooping 0");
  for (const auto& [host, address] : addresses_)
    run(kSwitch, "bridge link set dev " + host + " mcast_flood off");
}

void Network::disturb_wire(const std::string& host, const WireFaults& faults) {
  // host:eth0 – HOST – [relay] – HOST-w – HOST-p – br0
  run(kSwitch, "ip link set " + host + " nomaster");
  run(kSwitch, "ip link add " + host + "-w type veth peer name " + host + "-p");
  run(kSwitch, "ip link set " + host + "-w up && ip link set " + host + "-p master br0 up");
  std::vector<std::string> command = on(kSwitch);
  command.insert(command.end(),
                 {"/usr/bin/python3", "-BP", SLS_SOURCE_DIR "/python/sls/check/wire.py", host,
                  host + "-w", std::to_string(faults.delay_ms), std::to_string(faults.jitter_ms),
                  std::to_string(faults.duplicate_percent), std::to_string(faults.seed)});
  const auto& wire = wires_[host] = std::make_unique<Process>(command);
  if (!wait_until([&] { return !wire->output().empty(); }) || wire->output() != "ready\n")
    throw std::runtime_error("wire of " + host + ": " + wire->output());
}

std::string Network::end_wire(const std::string& host) {
  const auto wire = wires_.at(host).get();
  wire->send(SIGTERM);
  wire->wait(std::chrono::seconds(10));
  return wire->output();
}

}  // namespace sls::test
