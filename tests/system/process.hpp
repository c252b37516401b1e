/// Real processes for system tests: started, waited for with a deadline, and always ended with the
/// test.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tests/support/text.hpp"
#include "tests/support/waiting.hpp"

namespace sls::test {

using Words = std::vector<std::string>;

/// `words`, then `more`: of command lines.
inline Words operator+(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// One process. Its stdout and stderr go to a file, which `output()` reads.
class Process {
 public:
  explicit Process(const std::vector<std::string>& command);
  ~Process();  // kills the process if it still runs
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// The exit code, or 128 + signal; nothing if it still runs after `limit`.
  std::optional<int> wait(std::chrono::milliseconds limit = std::chrono::seconds(240));
  bool is_running();
  void send(int signal);
  /// Sends SIGKILL, and removes the files that the killed process can no longer remove. Waits for
  /// its end: a process that starts before that may take over its ports and is then never
  /// discovered.
  void kill();
  pid_t id() const { return id_; }
  /// Its output so far.
  std::string output() const;

 private:
  TemporaryFolder folder_;
  pid_t id_ = -1;
  std::optional<int> exit_code_;
};

/// Waits until the process has printed `text`.
bool wait_for_text(const Process& process, const std::string& text);

/// Waits for each, and expects exit code 0.
void expect_success(const std::vector<Process*>& processes);

struct Outcome {
  std::optional<int> code;  ///< nothing if it did not end in time
  std::string output;
};
Outcome run(const Words& command, std::chrono::milliseconds limit = std::chrono::seconds(240));
/// Runs `command`, expects that exit code, and returns the output.
std::string expect_exit(const Words& command, int code = 0);

/// Files of the process's own segment in /dev/shm. They remain if the process is killed.
std::vector<std::filesystem::path> find_shared_memory(pid_t id);

/// Kills any process and removes its shared-memory segment.
void kill_process(pid_t id);

/// The bytes of `file`; none if it does not exist (yet).
std::string read_file(const std::filesystem::path& file);

/// Path of one of the programs, of a shipped scenario (by name) or QoS file (by name).
std::string program(const std::string& name);
std::string scenario(const std::string& name);
std::string qos(const std::string& name);

/// Writes a shipped scenario (the short flight of 2 s, or another) with `changes` to its text into
/// `folder`.
std::string make_scenario(const TemporaryFolder& folder,
                          const std::vector<std::pair<std::string, std::string>>& changes,
                          const std::string& base = "short");

}  // namespace sls::test
