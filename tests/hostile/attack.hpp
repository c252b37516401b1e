/// Attacks of a hostile neighbour. Every attack goes on until SIGTERM, at most `seconds`, and
/// returns how many packets, samples or participants it fired.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace sls::hostile {

struct Target {
  std::string address;  ///< of the server's host
  int domain = 0;
  std::uint64_t seed = 1;
  double seconds = 60;
  bool endless_gaps = false;       ///< fire also what hangs the middleware
  bool forged_identities = false;  ///< fire also what takes all the memory of a secured one
};

/// True until SIGTERM, or `target.seconds` after the first call.
bool goes_on(const Target& target);
/// To be called when an attack is under way: says so on stdout, once, for the test waits for it.
void say_that_it_fires();

// --- without DDS: raw_attacks.cpp ----------------------------------------------------------------

/// Writes the RTPS packets of this host to `file`, 2,000 at most.
std::uint64_t capture(const Target& target, const std::filesystem::path& file);
/// Random bytes, and captured packets cut short or with bytes changed, to every port.
std::uint64_t fire_packets(const Target& target, const std::filesystem::path& captured);
/// The captured announcement of a participant, under a new GUID each time; `most` at most.
std::uint64_t announce_forgeries(const Target& target, const std::filesystem::path& captured,
                                 std::uint64_t most);
/// Packets of the flight that is under way, changed and sent under their sender's name. Must run
/// on the server's host.
std::uint64_t spoof(const Target& target);

// --- with DDS: strangers.cpp ---------------------------------------------------------------------

/// Participants that appear, say something and vanish.
std::uint64_t come_and_go(const Target& target);
/// Commands with every fault, copies of right ones, and such for the future.
std::uint64_t flood_commands(const Target& target);
/// States, batches, statuses, parameters and recorders that are not there.
std::uint64_t forge_statements(const Target& target);
/// Requests to sls/control that nobody may grant.
std::uint64_t flood_control(const Target& target);
/// Announces itself as the strongest controller; never answers, or with garbage.
std::uint64_t pose_as_controller(const Target& target, bool answers);
/// Reads every topic reliably; the test stops its process.
std::uint64_t read_all(const Target& target);
/// Samples that are cut short, of random bytes, endless or huge: malformed_samples.cpp.
std::uint64_t write_malformed(const Target& target);

}  // namespace sls::hostile
