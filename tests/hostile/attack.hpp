/// Attacks of a hostile host. Every attack runs until SIGTERM, for at most `seconds`, and returns
/// the number of packets, samples or participants that it sent.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace sls::hostile {

struct Target {
  std::vector<std::string> addresses;  ///< of the hosts of the flight
  int domain = 0;
  std::uint64_t seed = 1;
  double seconds = 60;
};

/// True until SIGTERM, or `target.seconds` after the first call.
bool goes_on(const Target& target);
/// Prints once, on stdout, that the attack is under way: the test waits for this line.
void say_that_it_fires();

// --- without DDS: raw_attacks.cpp ----------------------------------------------------------------

/// Writes the RTPS packets of this host to `file`, 2,000 at most.
std::uint64_t capture(const Target& target, const std::filesystem::path& file);
/// Random bytes, and captured packets with changes, to every port.
std::uint64_t fire_packets(const Target& target, const std::filesystem::path& captured);
/// Sends captured packets of the current flight with changes of every kind, in the name of
/// participants that do not exist, at most `most` of them.
std::uint64_t fire_mutations(const Target& target, const std::filesystem::path& captured,
                             std::uint64_t most);
/// Sends a captured participant announcement under a new GUID each time, at most `most` times.
std::uint64_t announce_forgeries(const Target& target, const std::filesystem::path& captured,
                                 std::uint64_t most);
/// Sends changed packets of the current flight in the name of their sender. Must run on the
/// server's host.
std::uint64_t spoof(const Target& target);

// --- with DDS: strangers.cpp ---------------------------------------------------------------------

/// Participants that join, write a sample and leave.
std::uint64_t come_and_go(const Target& target);
/// Commands with every kind of error, also for wrong and future steps.
std::uint64_t flood_commands(const Target& target);
/// False states, batches, statuses, parameters and recorder announcements.
std::uint64_t forge_statements(const Target& target);
/// Requests to sls/control that the server must refuse.
std::uint64_t flood_control(const Target& target);
/// Joins as the strongest controller; sends no answers, or invalid ones.
std::uint64_t pose_as_controller(const Target& target, bool answers);
/// Reads the flight's topics reliably. The test stops its process.
std::uint64_t read_all(const Target& target);
/// Truncated, random, endless or huge samples: malformed_samples.cpp.
std::uint64_t write_malformed(const Target& target);

}  // namespace sls::hostile
