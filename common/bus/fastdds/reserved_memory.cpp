/// Replaces `ftruncate` of the C library in the programs that link this file (sim_server,
/// control_client, recorder), and names a full /dev/shm when SIGBUS ends them.
///
/// Fast DDS makes its files in /dev/shm by `ftruncate` (boost::interprocess), without memory: a
/// process gets a page at its first write, or SIGBUS if none is left by then. Here a file gets all
/// its memory when it is made. Without it Fast DDS would go on, deaf for some of the others, so the
/// program ends. SIGBUS still comes where another program made the file.
///
/// Upstream: none reported. To be deleted when Fast DDS reserves the memory of its files.
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cstring>
#include <string>

namespace sls::bus {
namespace {

/// Async-signal-safe.
void print_error(bool is_full) {
  const char* cause =
      is_full ? ": error: /dev/shm is full: mount -o remount,size=64M /dev/shm (docker run "
                "--shm-size 64m), or --qos config/qos/udp.xml\n"
              : ": error: SIGBUS: memory of a file is gone: was the file cut, or a limit of memory "
                "reached? (./sls doctor)\n";
  for (const char* part : {static_cast<const char*>(program_invocation_short_name), cause})
    [[maybe_unused]] const auto written = ::write(STDERR_FILENO, part, std::strlen(part));
}

/// Ends the process by the signal as without this handler, which SA_RESETHAND has removed.
void explain(int number) {
  struct statfs system {};
  print_error(::statfs("/dev/shm", &system) == 0 && system.f_bavail == 0);
  ::raise(number);
}

[[gnu::constructor]] void set_handler() {
  struct sigaction action {
  }, earlier{};
  action.sa_handler = &explain;
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_ONSTACK);
  ::sigaction(SIGBUS, nullptr, &earlier);
  if (earlier.sa_handler == SIG_DFL) ::sigaction(SIGBUS, &action, nullptr);
}

/// Gives a file in /dev/shm memory for its bytes from `begin` to `end`, or ends the process.
void reserve(int file, off_t begin, off_t end) {
  std::string path(256, '\0');
  const std::string link = "/proc/self/fd/" + std::to_string(file);
  if (::readlink(link.c_str(), path.data(), path.size() - 1) < 0) return;
  if (path.rfind("/dev/shm/", 0) != 0) return;
  while (::fallocate(file, 0, begin, end - begin) != 0) {
    if (errno == EINTR) continue;
    if (errno != ENOSPC) return;
    ::unlink(path.c_str());  // others would wait until it is ready
    print_error(true);
    ::_exit(1);
  }
}

}  // namespace
}  // namespace sls::bus

extern "C" int ftruncate(int file, off_t size) noexcept {
  static const auto next = reinterpret_cast<decltype(&ftruncate)>(dlsym(RTLD_NEXT, "ftruncate"));
  struct stat status {};
  if (::fstat(file, &status) == 0 && size > status.st_size)
    sls::bus::reserve(file, status.st_size, size);
  return next(file, size);
}
extern "C" int ftruncate64(int file, off64_t size) noexcept __attribute__((alias("ftruncate")));
