#include "tests/system/process.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "common/bus/fastdds/stale_segments.hpp"
#include "fastdds_files.hpp"

namespace sls::test {

Process::Process(const std::vector<std::string>& command) {
  std::vector<char*> arguments;
  for (const auto& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const std::string output_file = folder_ / "output";
  id_ = fork();
  if (id_ < 0) throw std::runtime_error("fork");
  if (id_ == 0) {
    setpgid(0, 0);  // signals of the test's terminal do not reach it
    const int output = open(output_file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
    dup2(output, STDOUT_FILENO);
    dup2(output, STDERR_FILENO);
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
}

Process::~Process() {
  if (!is_running()) return;
  ::kill(-id_, SIGKILL);  // the process group: also a launcher's children
  wait(std::chrono::seconds(10));
}

std::optional<int> Process::wait(std::chrono::milliseconds limit) {
  wait_until([this] { return !is_running(); }, limit);
  return exit_code_;
}

bool Process::is_running() {
  if (exit_code_) return false;
  int status = 0;
  if (waitpid(id_, &status, WNOHANG) != id_) return true;
  exit_code_ = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  return false;
}

void Process::send(int signal) {
  if (is_running()) ::kill(id_, signal);
}

void Process::kill() {
  if (!is_running()) return;
  kill_process(id_);
  wait(std::chrono::seconds(10));
}

bool wait_for_text(const Process& process, const std::string& text) {
  return wait_until([&] { return holds(process.output(), text); });
}

void expect_success(const std::vector<Process*>& processes) {
  std::string outputs;
  for (Process* process : processes) process->wait();
  for (const Process* process : processes) outputs += process->output();
  for (Process* process : processes) EXPECT_EQ(process->wait({}), 0) << outputs;
}

Outcome run(const Words& command, std::chrono::milliseconds limit) {
  Process process(command);
  const auto code = process.wait(limit);
  return {code, process.output()};
}

std::string expect_exit(const Words& command, int code) {
  const Outcome outcome = run(command);
  EXPECT_EQ(outcome.code, code) << command.front() << "\n" << outcome.output;
  return outcome.output;
}

std::vector<std::filesystem::path> find_shared_memory(pid_t id) {
  namespace fs = std::filesystem;
  // Fast DDS holds a lock file NAME_el open for its own segment NAME. The ports are not
  // among them: other processes have them open, and the next process takes them over. The
  // files of its shared data are open, too (common/bus/fastdds/data_sharing.hpp).
  const std::string prefix = std::string("/dev/shm/") + bus::kSharedMemoryPrefix, suffix = "_el";
  const std::string shared = std::string("/dev/shm/") + bus::kDataSharingPrefix;
  std::vector<fs::path> own;
  for (const auto& descriptor : fs::directory_iterator("/proc/" + std::to_string(id) + "/fd")) {
    std::error_code gone;
    const std::string name = fs::read_symlink(descriptor, gone).string();
    const bool is_lock = name.rfind(prefix, 0) == 0 && name.rfind(prefix + "port", 0) != 0 &&
                         name.compare(name.size() - suffix.size(), suffix.size(), suffix) == 0;
    if (name.rfind(shared, 0) == 0) own.push_back(name);
    if (is_lock) own.insert(own.end(), {name, name.substr(0, name.size() - suffix.size())});
  }
  return own;
}

void kill_process(pid_t id) {
  const auto own = find_shared_memory(id);
  ::kill(id, SIGKILL);
  for (const auto& file : own) std::filesystem::remove(file);
}

std::string Process::output() const { return read_file(folder_ / "output"); }

std::string read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::string program(const std::string& name) { return std::string(SLS_PROGRAM_DIR) + "/" + name; }
std::string scenario(const std::string& name) {
  return std::string(SLS_SOURCE_DIR) + "/config/scenarios/" + name + ".yaml";
}
std::string qos(const std::string& name) {
  return std::string(SLS_SOURCE_DIR) + "/config/qos/" + name + ".xml";
}

std::string make_scenario(const TemporaryFolder& folder,
                          const std::vector<std::pair<std::string, std::string>>& changes,
                          const std::string& base) {
  std::string text = read_file(scenario(base));
  for (const auto& [from, to] : changes) text = replace_once(text, from, to);
  const std::string file = folder / "scenario.yaml";
  write_bytes(file, text);
  return file;
}

}  // namespace sls::test
