/// LD_PRELOAD library that logs the order of a process's calls of fsync and rename, one line each
/// in the file SLS_SYNC_LOG: "sync FILE BYTES" or "rename FROM TO".
#include <dlfcn.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace {

void note(const std::string& line) {
  std::ofstream(std::getenv("SLS_SYNC_LOG"), std::ios::app) << line + '\n';
}

}  // namespace

extern "C" int fsync(int descriptor) {
  static const auto next = reinterpret_cast<decltype(&fsync)>(dlsym(RTLD_NEXT, "fsync"));
  struct stat status {};
  fstat(descriptor, &status);
  const int result = next(descriptor);
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  if (result == 0)
    note("sync " + std::filesystem::read_symlink(link).string() + ' ' +
         std::to_string(status.st_size));
  return result;
}

extern "C" int rename(const char* from, const char* to) noexcept {
  static const auto next = reinterpret_cast<decltype(&rename)>(dlsym(RTLD_NEXT, "rename"));
  const int result = next(from, to);
  if (result == 0) note(std::string("rename ") + from + ' ' + to);
  return result;
}
