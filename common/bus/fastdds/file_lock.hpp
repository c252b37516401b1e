/// Files in shared memory are in use while a process holds a lock on them.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>

namespace sls::bus {

/// Holds a lock on a file while this object exists, if it got it at once.
class FileLock {
 public:
  /// `operation`: LOCK_SH or LOCK_EX of flock(2).
  FileLock(const std::filesystem::path& file, int operation)
      : descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW)),
        is_held_(descriptor_ >= 0 && ::flock(descriptor_, operation | LOCK_NB) == 0) {}
  ~FileLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;
  bool is_held() const { return is_held_; }

 private:
  const int descriptor_;
  const bool is_held_;
};

}  // namespace sls::bus
