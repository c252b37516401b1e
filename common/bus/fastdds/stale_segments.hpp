/// Segments that killed processes leave in shared memory (README.md, trap 11). Upstream: #2790, and
/// #4728 for the ports. To be deleted when creating a participant removes stale segments and
/// notifies the processes that have a stale port open; stale_segments_test.cpp names the cases.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <set>
#include <vector>

namespace sls::bus {

/// Beginning of the names of the files in /dev/shm that Fast DDS makes for data sharing.
inline constexpr const char* kDataSharingPrefix = "fast_datasharing_";
/// Mode bit of those of our endpoints, which hold a lock on them.
inline constexpr mode_t kOwnMark = S_ISVTX;

/// Largest memory that an endpoint of the loop shares, bytes: the server's last 64 states of 64
/// vehicles. A flight of a few vehicles touches a tenth of it.
inline constexpr std::uint32_t kMostSharedData = 5'500'000;

/// Removes the shared-memory segments of killed processes, their memory for data sharing, and what
/// they had not finished when they were killed. Otherwise these files, 4 MB and more, would stay
/// until the machine restarts. With a full /dev/shm the next process would crash, and a process
/// that opens an unfinished port waits for ever. Those of living processes, which hold a lock, and
/// of other users stay. Never throws.
void remove_stale_segments(const std::filesystem::path& folder = "/dev/shm");

/// The segments that `remove_stale_segments` would remove, of all owners.
std::vector<std::filesystem::path> find_stale_segments(
    const std::filesystem::path& folder = "/dev/shm");

/// With more participants the ports of one domain would overlap those of the next.
inline constexpr int kMaxParticipantIds = 110;

/// Port numbers of RTPS participants: participant `id` has base + id × gain and the number after
/// it.
struct ParticipantPorts {
  int base = 7410;
  int gain = 2;
};

/// True if a living process reads a port, whose files are in `folder` (make_memory_port()).
bool is_port_read(std::uint32_t memory_port, const std::filesystem::path& folder = "/dev/shm");

/// The participant id to request, or −1 if Fast DDS can choose any.
///
/// A killed process leaves the lock files of its ports, and the next process on such a port
/// replaces the port. A process that has the old port open gets no notice: neither process receives
/// the other's data (Fast DDS 2.9, #4728). One killed while it made a port leaves a file at which
/// the next waits for ever. So if there are such files, an id without any is chosen, which is not
/// in `own_ids`, those of this process (participant_ids.hpp).
int choose_participant_id(const ParticipantPorts& ports, const std::set<int>& own_ids,
                          const std::filesystem::path& folder = "/dev/shm");

}  // namespace sls::bus
