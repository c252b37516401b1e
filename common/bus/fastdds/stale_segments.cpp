#include "common/bus/fastdds/stale_segments.hpp"

#include <chrono>
#include <string>
#include <string_view>
#include <system_error>

#include "common/bus/fastdds/file_lock.hpp"
#include "fastdds_files.hpp"

namespace sls::bus {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSegmentPrefix = kSharedMemoryPrefix, kLock = "_el";

/// Younger segments may not be locked yet: a segment is created a moment before its lock is taken.
constexpr auto kCreationTime = std::chrono::seconds(10);

/// The prefix, sixteen hexadecimal digits, "_el": the lock file of a participant's segment.
bool is_segment_lock(std::string_view name) {
  constexpr std::size_t kDigits = 16;
  if (name.size() != kSegmentPrefix.size() + kDigits + kLock.size()) return false;
  if (name.substr(0, kSegmentPrefix.size()) != kSegmentPrefix) return false;
  if (name.substr(name.size() - kLock.size()) != kLock) return false;
  const auto digits = name.substr(kSegmentPrefix.size(), kDigits);
  return digits.find_first_not_of("0123456789abcdef") == digits.npos;
}

/// The shared memory of one of our endpoints for data sharing (data_sharing.hpp). Other programs'
/// has no mark, and no lock either.
bool is_own_shared_data(const fs::directory_entry& entry) {
  std::error_code gone;
  return entry.path().filename().string().rfind(kDataSharingPrefix, 0) == 0 &&
         (entry.status(gone).permissions() & fs::perms(kOwnMark)) != fs::perms::none;
}

enum class PortState { kFree, kInUse, kStale };

PortState find_state(int port, const fs::path& folder) {
  const fs::path file =
      folder / (std::string(kSegmentPrefix) + "port" + std::to_string(port) + std::string(kLock));
  std::error_code error;
  if (!fs::exists(file, error)) return PortState::kFree;
  return FileLock(file, LOCK_EX).is_held() ? PortState::kStale : PortState::kInUse;
}

/// Calls `visit(segment, lock_file)` for each stale segment, while its lock is held.
template <class Visit>
void visit_stale_segments(const fs::path& folder, const Visit& visit) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const fs::path file = entry.path();
    const std::string name = file.filename().string();
    const bool is_shared_data = is_own_shared_data(entry);
    if (!is_shared_data && !is_segment_lock(name)) continue;
    std::error_code ignored;  // gone meanwhile, or of another user
    const auto changed = fs::last_write_time(file, ignored);
    if (ignored || fs::file_time_type::clock::now() - changed < kCreationTime) continue;
    if (const FileLock lock(file, LOCK_EX); lock.is_held())
      visit(is_shared_data ? file : folder / name.substr(0, name.size() - kLock.size()), file);
  }
}

}  // namespace

void remove_stale_segments(const fs::path& folder) {
  visit_stale_segments(folder, [](const fs::path& segment, const fs::path& lock_file) {
    std::error_code ignored;  // gone meanwhile, or of another user
    fs::remove(segment, ignored);
    fs::remove(lock_file, ignored);
  });
}

std::vector<fs::path> find_stale_segments(const fs::path& folder) {
  std::vector<fs::path> found;
  visit_stale_segments(folder,
                       [&](const fs::path& segment, const fs::path&) { found.push_back(segment); });
  return found;
}

bool is_port_read(int port, const fs::path& folder) {
  return find_state(port, folder) == PortState::kInUse;
}

int choose_participant_id(const ParticipantPorts& ports, const std::set<int>& own_ids,
                          const fs::path& folder) {
  bool is_any_stale = false;
  int first_free = -1;
  for (int id = 0; id < kMaxParticipantIds; ++id) {
    const int port = ports.base + id * ports.gain;
    const PortState meta = find_state(port, folder), user = find_state(port + 1, folder);
    if (meta == PortState::kStale || user == PortState::kStale) is_any_stale = true;
    const bool is_free =
        meta == PortState::kFree && user == PortState::kFree && own_ids.count(id) == 0;
    if (is_free && first_free < 0) first_free = id;
  }
  return is_any_stale ? first_free : -1;
}

}  // namespace sls::bus
