/// Random disturbances of real flights: in every trial one process of a lockstep flight is stopped
/// and continued, or killed and restarted, at a random moment. The flight must succeed, and its
/// recording must equal that of an undisturbed flight. If a process blocks the others for 2 s, they
/// must have named it by then. (If a client is killed for good before the flight begins, the run
/// cannot begin, and its error must name the missing client.) A seed repeats the random choices,
/// but not the timing of the machine.
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <random>
#include <sstream>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

const std::vector<std::string> kFlags = {"--period-s", "0.001"};  // a trial lasts seconds
constexpr auto kNamingLimit = 2s;
constexpr auto kTrialLimit = 120s;

enum class Role { kServer, kPrimary, kStandby, kRecorder };
enum class Kind { kStop, kKillAndRestart, kKillForGood };

struct Disturbance {
  Role role = Role::kServer;
  Kind kind = Kind::kStop;
  Seconds at{0};        // after the start of the trial
  Seconds duration{0};  // until it is continued or restarted
};

const char* to_string(Role role) {
  switch (role) {
    case Role::kServer:
      return "server";
    case Role::kPrimary:
      return "primary client";
    case Role::kStandby:
      return "standby client";
    case Role::kRecorder:
      return "recorder";
  }
  return "?";
}

/// Name of the role in the messages of the other processes.
const char* find_name(Role role) {
  switch (role) {
    case Role::kServer:
      return "server";
    case Role::kPrimary:
      return "controller";
    case Role::kStandby:
      return "controller";
    case Role::kRecorder:
      return "recorder";
  }
  return "?";
}

Disturbance choose(std::mt19937_64& random) {
  const auto draw = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random);
  };
  Disturbance disturbance;
  disturbance.role = static_cast<Role>(random() % 4);
  disturbance.kind = static_cast<Kind>(random() % 2);
  if (disturbance.role == Role::kPrimary && random() % 3 == 0)
    disturbance.kind = Kind::kKillForGood;
  disturbance.at = Seconds(draw(0.1, 4.5));  // during start, flight (about 3 s) or end
  disturbance.duration = Seconds(draw(0.2, 4.0));
  return disturbance;
}

std::string describe(const Disturbance& disturbance) {
  char text[160];
  const char* what = disturbance.kind == Kind::kStop             ? "SIGSTOP"
                     : disturbance.kind == Kind::kKillAndRestart ? "SIGKILL"
                                                                 : "SIGKILL for good";
  const char* then = disturbance.kind == Kind::kStop ? ", SIGCONT" : ", restart";
  std::snprintf(text, sizeof text, "%s of the %s at %.2f s", what, to_string(disturbance.role),
                disturbance.at.count());
  std::string line = text;
  if (disturbance.kind == Kind::kKillForGood) return line;
  std::snprintf(text, sizeof text, "%s %.2f s later", then, disturbance.duration.count());
  return line + text;
}

/// Result of a trial. An empty `failure` means passed.
struct Result {
  std::string failure;
  std::string success = "recording equal";
  std::optional<Seconds> named_after;
  bool had_to_be_named = false;
};

class Trial {
 public:
  Trial(const std::string& scenario_file, const fs::path& undisturbed, Disturbance disturbance)
      : scenario_(scenario_file), undisturbed_(undisturbed), disturbance_(disturbance) {}

  Result run() {
    for (const Role role : {Role::kRecorder, Role::kServer, Role::kPrimary, Role::kStandby})
      start(role);
    const auto began = Clock::now();
    wait_until([&] { return Clock::now() - began >= disturbance_.at || !is_anyone_running(); });
    if (is_anyone_running()) disturb();
    judge_end();
    return result_;
  }

  std::string outputs() const {
    std::string text;
    for (const auto& process : processes_) text += process.second->output();
    return text;
  }

 private:
  void start(Role role) {
    const int domain = domain_.number();
    const auto start_program = [&](const char* name, std::vector<std::string> flags) {
      processes_.emplace_back(role, std::make_unique<Process>(make_command(name, domain, flags)));
    };
    switch (role) {
      case Role::kServer:
        return start_program("sim_server",
                             std::vector<std::string>{"--scenario", scenario_} + kFlags);
      case Role::kPrimary:
        return start_program("control_client", {"--scenario", scenario_, "--name", "primary",
                                                "--strength", "2", "--follow"});
      case Role::kStandby:
        return start_program("control_client", {"--scenario", scenario_, "--name", "standby",
                                                "--strength", "1", "--follow"});
      case Role::kRecorder:
        return start_program("recorder", {"--out", recording(), "--resume", "--follow"});
    }
  }

  std::string recording() const { return folder_ / "recording"; }

  Process& current(Role role) const {
    const auto found = std::find_if(processes_.rbegin(), processes_.rend(),
                                    [&](const auto& process) { return process.first == role; });
    return *found->second;
  }

  bool is_anyone_running() const {
    return std::any_of(processes_.begin(), processes_.end(),
                       [](const auto& process) { return process.second->is_running(); });
  }
  bool is_anyone_else_running() const {
    for (const Role role : {Role::kServer, Role::kPrimary, Role::kStandby, Role::kRecorder})
      if (role != disturbance_.role && current(role).is_running()) return true;
    return false;
  }

  /// True once another process has printed the disturbed role's name since the disturbance.
  bool is_named(const std::vector<std::size_t>& lengths) const {
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      if (processes_[i].first == disturbance_.role) continue;
      const std::string output = processes_[i].second->output();
      std::istringstream news(output.substr(std::min(lengths[i], output.size())));
      for (std::string line; std::getline(news, line);) {
        const auto message = line.find(": ");  // after the program's own name
        if (message != line.npos && line.find(find_name(disturbance_.role), message) != line.npos)
          return true;
      }
    }
    return false;
  }

  void disturb() {
    std::vector<std::size_t> lengths;
    for (const auto& process : processes_) lengths.push_back(process.second->output().size());
    Process& victim = current(disturbance_.role);
    const auto began = Clock::now();
    if (disturbance_.kind == Kind::kStop)
      victim.send(SIGSTOP);
    else
      victim.kill();

    // No process waits for a standby.
    const bool may_stall = disturbance_.role != Role::kStandby;
    const auto elapsed = [&] { return Seconds(Clock::now() - began); };
    wait_until(
        [&] {
          if (!result_.named_after && is_named(lengths)) result_.named_after = elapsed();
          return disturbance_.kind == Kind::kKillForGood
                     ? result_.named_after || elapsed() > kNamingLimit || !is_anyone_else_running()
                     : elapsed() >= disturbance_.duration;
        },
        kTrialLimit);
    const bool lasted = elapsed() > kNamingLimit && is_anyone_else_running();
    result_.had_to_be_named = may_stall && lasted;
    if (result_.had_to_be_named &&
        (!result_.named_after || *result_.named_after > Seconds(kNamingLimit)))
      result_.failure = "silent stall: the culprit was not named within 2 s";
    if (disturbance_.kind == Kind::kStop) victim.send(SIGCONT);
    if (disturbance_.kind == Kind::kKillAndRestart && is_anyone_else_running())
      start(disturbance_.role);
  }

  /// Recording of the last run, which must equal the undisturbed one.
  fs::path find_recording() const {
    fs::path found = recording();
    fs::file_time_type newest = fs::file_time_type::min();
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(recording(), none)) {
      if (entry.path().filename().string().rfind("run-", 0) != 0) continue;
      if (entry.last_write_time() < newest) continue;
      newest = entry.last_write_time();
      found = entry.path();
    }
    return found;
  }

  bool is_equal(std::string& answer) const {
    Process verify({program("sls_verify"), find_recording().string(), undisturbed_.string()});
    const auto code = verify.wait();
    answer = verify.output();
    return code == 0;
  }

  /// True if the run required two clients, had one, did not begin and printed the reason.
  bool has_rightly_not_begun() {
    return disturbance_.kind == Kind::kKillForGood && current(Role::kServer).wait(0s) == 1 &&
           current(Role::kServer).output().find("not ready within 30 s: 2 controllers (1 ready)") !=
               std::string::npos &&
           Table(fs::path(recording()) / "state.csv").rows() == 0;
  }

  void judge_end() {
    // A process restarted just after the end of the run finds no run: SIGTERM below ends it.
    const auto is_over = [&] {
      return !current(Role::kServer).is_running() && !current(Role::kRecorder).is_running();
    };
    std::string answer;
    const auto deadline = Clock::now() + kTrialLimit;
    wait_until([&] { return is_over() || Clock::now() >= deadline; }, kTrialLimit);
    if (!is_over() && !is_equal(answer)) {
      result_.failure = "hang: not ended within 120 s";
      return;
    }
    for (const auto& process : processes_) process.second->send(SIGTERM);
    for (const auto& process : processes_)
      if (!process.second->wait(15s)) result_.failure = "hang: a process did not end";
    if (!result_.failure.empty()) return;
    if (has_rightly_not_begun())
      result_.success = "did not begin with one of two clients, and said so";
    else if (!is_equal(answer))
      result_.failure = "the recording is not that of an undisturbed flight: " + answer;
  }

  const std::string scenario_;
  const fs::path undisturbed_;
  const Disturbance disturbance_;
  TemporaryFolder folder_;
  OwnDomain domain_;
  std::vector<std::pair<Role, std::unique_ptr<Process>>> processes_;
  Result result_;
};

/// Number of processes that still run after their trial. All are children of this process.
int count_orphans() {
  const std::string parent = "PPid:\t" + std::to_string(getpid()) + "\n";
  int orphans = 0;
  for (const auto& entry : fs::directory_iterator("/proc"))
    if (read_file(entry.path() / "status").find(parent) != std::string::npos) ++orphans;
  return orphans;
}

int run_trials(int trials, std::uint64_t seed, bool is_verbose) {
  TemporaryFolder folder;
  const std::string file = make_scenario(
      folder, {{"controllers: 1", "controllers: 2"}, {"for_s: 32", "for_s: 16"}}, "figure_eight");
  const fs::path undisturbed = fly_in_process(file, folder / "undisturbed", kFlags);
  if (!fs::exists(undisturbed / "manifest.json")) {
    std::cerr << "chaos: error: the undisturbed flight failed\n";
    return 1;
  }

  int failed = 0, named = 0, had_to_be_named = 0;
  double slowest_s = 0.0;
  for (int i = 0; i < trials; ++i) {
    std::mt19937_64 random(seed * 1'000'003 + static_cast<std::uint64_t>(i));
    const Disturbance disturbance = choose(random);
    std::printf("trial %d: %s: ", i + 1, describe(disturbance).c_str());
    std::fflush(stdout);
    const auto began = Clock::now();
    Trial trial(file, undisturbed, disturbance);
    const Result result = trial.run();
    if (result.named_after) {
      ++named;
      if (result.had_to_be_named) slowest_s = std::max(slowest_s, result.named_after->count());
      std::printf("named after %.2f s, ", result.named_after->count());
    }
    had_to_be_named += result.had_to_be_named ? 1 : 0;
    std::printf("ended after %.1f s, %s\n", Seconds(Clock::now() - began).count(),
                result.failure.empty() ? result.success.c_str() : result.failure.c_str());
    if (!result.failure.empty() || is_verbose) std::printf("%s", trial.outputs().c_str());
    std::fflush(stdout);
    failed += result.failure.empty() ? 0 : 1;
  }
  const int orphans = count_orphans();
  std::printf(
      "%d trials with seed %llu: %d failed, %d orphans; %d culprits had to be named, the slowest "
      "was after %.2f s\n",
      trials, static_cast<unsigned long long>(seed), failed, orphans, had_to_be_named, slowest_s);
  return failed == 0 && orphans == 0 ? 0 : 1;
}

}  // namespace
}  // namespace sls::test

int main(int argc, char** argv) {
  CLI::App cli(
      "Stops, continues, kills and restarts processes of real flights at random and\nchecks the "
      "results.");
  int trials = 10;
  std::uint64_t seed = 1;
  bool is_verbose = false;
  cli.option_defaults()->always_capture_default();
  cli.add_option("--trials", trials, "number of flights")
      ->type_name("N")
      ->check(CLI::Range(1, 100000));
  cli.add_option("--seed", seed, "seed of the disturbances")->type_name("S");
  cli.add_flag("--verbose", is_verbose, "print the output of the processes");
  CLI11_PARSE(cli, argc, argv);
  return sls::test::run_trials(trials, seed, is_verbose);
}
