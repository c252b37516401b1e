#include "tools/doctor/other_end.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>
#include <thread>
#include <vector>

namespace sls::doctor {
namespace {

constexpr const char* kSeconds = "20";  // longer than any examination
constexpr auto kPatience = std::chrono::seconds(2);

}  // namespace

OtherEnd::OtherEnd(const std::filesystem::path& qos_file, int domain, const std::string& identity) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe");
  std::vector<std::string> words = {
      program,      "--answer",        "--for-s",     kSeconds,
      "--qos",      qos_file.string(), "--domain",    std::to_string(domain),
      "--identity", identity,          "--log-level", "error"};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const pid_t parent = ::getpid();
  id_ = ::fork();
  if (id_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (id_ > 0) return;
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(1);  // the parent was killed before this line
  if (const int null = ::open("/dev/null", O_WRONLY); null >= 0) ::dup2(null, STDOUT_FILENO);
  ::execv(program.c_str(), arguments.data());
  ::_exit(127);
}

OtherEnd::~OtherEnd() {
  if (!find_end().empty()) return;
  ::kill(id_, SIGTERM);
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (find_end().empty()) {
    if (std::chrono::steady_clock::now() > deadline) ::kill(id_, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

std::string OtherEnd::find_end() {
  int status = 0;
  if (!end_.empty() || ::waitpid(id_, &status, WNOHANG) != id_) return end_;
  if (WIFSIGNALED(status))
    end_ =
        "signal " + std::to_string(WTERMSIG(status)) + " (" + ::strsignal(WTERMSIG(status)) + ")";
  else
    end_ = "exit code " + std::to_string(WEXITSTATUS(status));
  return end_;
}

}  // namespace sls::doctor
