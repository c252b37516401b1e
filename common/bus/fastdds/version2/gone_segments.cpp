/// Replaces a function of the C library in the programs that link this file (sim_server,
/// control_client, recorder). These programs then keep receiving when another process has left
/// before they read its first message.
///
/// Fast DDS before 2.13 puts a message into a segment of the sender, and a descriptor into the port
/// of the receiver, which opens the segment at the first descriptor. If the sender has left by
/// then, opening fails, the descriptor stays in the port, and the thread that reads the port tries
/// again for ever: this process receives nothing more over shared memory (README.md, trap 32). So
/// such a segment opens as a copy of a segment of this process. Its buffers are those of old
/// messages of our own, which the middleware ignores, and mostly already invalid.
///
/// Upstream: #3992, in 2.13 and 3. To be deleted when 2.9 is no longer supported.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <mutex>
#include <string>
#include <string_view>

#include "common/bus/fastdds/segment_names.hpp"

namespace sls::bus {
namespace {

/// True for the name of a participant's segment as shm_open gets it: with a "/" before it.
bool is_segment_path(std::string_view name) {
  return !name.empty() && name.front() == '/' && is_segment(name.substr(1));
}

using Open = int (*)(const char*, int, mode_t);

Open find_original() {
  static const auto original = reinterpret_cast<Open>(dlsym(RTLD_NEXT, "shm_open"));
  return original;
}

/// The last segment that this process has made.
struct OwnSegment {
  std::mutex mutex;  // guards `name`
  std::string name;
};

OwnSegment& own_segment() {
  static OwnSegment own;
  return own;
}

/// A copy of our own segment, as a file without a name; −1 without one.
int copy_own_segment() {
  OwnSegment& own = own_segment();
  std::string name;
  {
    const std::lock_guard lock(own.mutex);
    name = own.name;
  }
  if (name.empty()) return -1;
  const int source = find_original()(name.c_str(), O_RDONLY | O_CLOEXEC, 0);
  if (source < 0) return -1;
  struct stat status {};
  const int copy = ::memfd_create("sls_gone_segment", MFD_CLOEXEC);
  bool is_whole = copy >= 0 && ::fstat(source, &status) == 0;
  for (off_t left = status.st_size; is_whole && left > 0;) {
    const ssize_t sent = ::sendfile(copy, source, nullptr, static_cast<std::size_t>(left));
    is_whole = sent > 0;
    left -= std::max<ssize_t>(sent, 0);
  }
  ::close(source);
  if (is_whole) return copy;
  if (copy >= 0) ::close(copy);
  return -1;
}

}  // namespace
}  // namespace sls::bus

extern "C" int shm_open(const char* name, int flags, mode_t mode) {
  using namespace sls::bus;
  const int descriptor = find_original()(name, flags, mode);
  if (!is_segment_path(name)) return descriptor;
  if (descriptor >= 0 && (flags & O_CREAT) != 0) {
    OwnSegment& own = own_segment();
    const std::lock_guard lock(own.mutex);
    own.name = name;
  }
  if (descriptor >= 0 || errno != ENOENT || (flags & O_CREAT) != 0) return descriptor;
  const int copy = copy_own_segment();
  errno = ENOENT;  // of a copy that could not be made
  return copy;
}
