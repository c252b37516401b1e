/// Segments that killed processes leave in shared memory (README.md, trap 11). Upstream: #2790, and
/// #4728 for the ports. To be deleted when creating a participant removes stale segments and tells
/// those who have a stale port open; stale_segments_test.cpp names the cases.
#pragma once

#include <filesystem>
#include <vector>

namespace sls::bus {

/// Removes shared-memory segments that killed processes have left: a process that is killed cannot
/// remove its own (4 MB each, until the machine restarts), and with a full /dev/shm the next one
/// would crash. Those of living processes are held by a lock and stay; so do those of other users.
/// Never throws.
void remove_stale_segments(const std::filesystem::path& folder = "/dev/shm");

/// The segments that `remove_stale_segments` would remove, of all owners.
std::vector<std::filesystem::path> find_stale_segments(
    const std::filesystem::path& folder = "/dev/shm");

/// Port numbers of RTPS participants: those of participant `id` are base + id × gain, and one more.
struct ParticipantPorts {
  int base = 7410;
  int gain = 2;
};

/// True if a living process reads the shared-memory port of that number, here in `folder`.
bool is_port_read(int port, const std::filesystem::path& folder = "/dev/shm");

/// The participant id to ask for, or −1 if any will do.
///
/// A killed process leaves the lock files of its ports, and the next process on such a port
/// replaces it. A process that still has the old one open is not told: neither receives the other's
/// data (Fast DDS 2.9, #4728). So where there are such files, an id is chosen that has none.
int choose_participant_id(const ParticipantPorts& ports,
                          const std::filesystem::path& folder = "/dev/shm");

}  // namespace sls::bus
