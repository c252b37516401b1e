#include "common/bus/fastdds/stale_segments.hpp"

#include <chrono>
#include <string>
#include <string_view>
#include <system_error>

#include "common/bus/fastdds/file_lock.hpp"
#include "common/bus/fastdds/guarded_transports.hpp"
#include "common/bus/fastdds/segment_names.hpp"

namespace sls::bus {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSegmentPrefix = kSharedMemoryPrefix, kLock = "_el";

/// Younger segments may not be locked yet: a segment is created a moment before its lock is taken.
constexpr auto kCreationTime = std::chrono::seconds(10);

bool begins_with(std::string_view name, std::string_view prefix) {
  return name.substr(0, prefix.size()) == prefix;
}

/// The lock file of a participant's segment: its name and "_el".
bool is_segment_lock(std::string_view name) {
  return name.size() > kLock.size() && name.substr(name.size() - kLock.size()) == kLock &&
         is_segment(name.substr(0, name.size() - kLock.size()));
}

/// A port, or memory for data sharing.
bool is_made_in_steps(std::string_view name) {
  const std::string port = std::string(kSegmentPrefix) + "port";
  return begins_with(name, kDataSharingPrefix) ||
         (begins_with(name, port) && name.size() > port.size() &&
          name.find_first_not_of("0123456789", port.size()) == name.npos);
}

/// True if the process that made the file has finished it. Boost.Interprocess keeps this state in
/// the first number of the file. A process that opens an unfinished file waits for its maker: for
/// ever, if that one was killed.
bool is_finished(const fs::path& file) {
  constexpr std::uint32_t kInitialised = 2;
  std::uint32_t state = 0;
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (descriptor < 0) return true;  // gone, or of another user
  const bool is_read = ::pread(descriptor, &state, sizeof state, 0) == sizeof state;
  ::close(descriptor);
  return is_read && state == kInitialised;
}

/// The shared memory of one of our endpoints for data sharing (data_sharing.hpp). Other programs'
/// has no mark, and no lock either.
bool is_own_shared_data(const fs::directory_entry& entry) {
  std::error_code gone;
  return entry.path().filename().string().rfind(kDataSharingPrefix, 0) == 0 &&
         (entry.status(gone).permissions() & fs::perms(kOwnMark)) != fs::perms::none;
}

enum class PortState { kFree, kInUse, kStale };

PortState find_state(std::uint32_t memory_port, const fs::path& folder) {
  const std::string file =
      folder / (std::string(kSegmentPrefix) + "port" + std::to_string(memory_port));
  const std::string lock_file = file + std::string(kLock);
  std::error_code error;
  if (fs::exists(lock_file, error))
    return FileLock(lock_file, LOCK_EX).is_held() ? PortState::kStale : PortState::kInUse;
  return is_finished(file) ? PortState::kFree : PortState::kStale;
}

/// Calls `visit(segment, lock_file)` for each stale segment, while its lock is held.
template <class Visit>
void visit_stale_segments(const fs::path& folder, const Visit& visit) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const fs::path file = entry.path();
    const std::string name = file.filename().string();
    const bool has_lock_file = is_segment_lock(name);
    std::error_code ignored;  // gone meanwhile, or of another user
    if (!has_lock_file && !is_own_shared_data(entry) &&
        !(is_segment(name) && !fs::exists(file.string() + std::string(kLock), ignored)) &&
        !(is_made_in_steps(name) && !is_finished(file)))
      continue;
    const auto changed = fs::last_write_time(file, ignored);
    if (ignored || fs::file_time_type::clock::now() - changed < kCreationTime) continue;
    if (const FileLock lock(file, LOCK_EX); lock.is_held())
      visit(has_lock_file ? folder / name.substr(0, name.size() - kLock.size()) : file, file);
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

bool is_port_read(std::uint32_t memory_port, const fs::path& folder) {
  return find_state(memory_port, folder) == PortState::kInUse;
}

int choose_participant_id(const ParticipantPorts& ports, const std::set<int>& own_ids,
                          const fs::path& folder) {
  bool is_any_stale = false;
  int first_free = -1;
  for (int id = 0; id < kMaxParticipantIds; ++id) {
    const std::uint32_t port =
        make_memory_port(static_cast<std::uint32_t>(ports.base + id * ports.gain));
    const PortState meta = find_state(port, folder), user = find_state(port + 1, folder);
    if (meta == PortState::kStale || user == PortState::kStale) is_any_stale = true;
    const bool is_free =
        meta == PortState::kFree && user == PortState::kFree && own_ids.count(id) == 0;
    if (is_free && first_free < 0) first_free = id;
  }
  return is_any_stale ? first_free : -1;
}

}  // namespace sls::bus
