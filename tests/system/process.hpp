/// Real processes for system tests: started, waited for with a deadline, and never left behind,
/// whatever the test does.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tests/support/text.hpp"
#include "tests/support/waiting.hpp"

namespace sls::test {

/// One process. Its stdout and stderr go to a file, which `output()` reads.
class Process {
 public:
  explicit Process(const std::vector<std::string>& command);
  ~Process();  // kills what still runs
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// The exit code, or 128 + signal; nothing if it still runs after `limit`.
  std::optional<int> wait(std::chrono::milliseconds limit = std::chrono::seconds(240));
  bool is_running();
  void send(int signal);
  /// SIGKILL, and what it keeps the process from removing is removed. Waits for its end: a process
  /// that is started while another one still dies may take over its ports, and is never discovered.
  void kill();
  pid_t id() const { return id_; }
  /// Everything it has printed so far.
  std::string output() const;

 private:
  TemporaryFolder folder_;
  pid_t id_ = -1;
  std::optional<int> exit_code_;
};

/// The segment in /dev/shm that a process has to itself: left behind when it is killed.
std::vector<std::filesystem::path> find_shared_memory(pid_t id);

/// Ends any process for good, and removes its shared-memory segment, which it can no longer.
void kill_process(pid_t id);

/// The bytes of `file`; none if it does not exist (yet).
std::string read_file(const std::filesystem::path& file);

/// Path of one of the programs, of a shipped scenario (by name) or QoS file (by name).
std::string program(const std::string& name);
std::string scenario(const std::string& name);
std::string qos(const std::string& name);

/// A shipped scenario, the short flight (2 s) or another, with `changes` to its text: a file in
/// `folder`.
std::string make_scenario(const TemporaryFolder& folder,
                          const std::vector<std::pair<std::string, std::string>>& changes,
                          const std::string& base = "short");

}  // namespace sls::test
