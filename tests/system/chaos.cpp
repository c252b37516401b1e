/// Random disturbances of real flights: in every trial one process of a lockstep flight is stopped
/// and continued, or killed and restarted, at a random moment. The flight must succeed, and its
/// recording must equal that of an undisturbed flight. If a process blocks the others for 2 s, they
/// must have named it by then. (If a client is killed for good before the flight begins, the run
/// cannot begin, and its error must name the missing client.) A seed repeats the random choices,
/// but not the timing of the machine.
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <random>
#include <sstream>

#include "common/config/faults.hpp"
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

namespace faults = config::faults;
using faults::Kind;

/// Of the two controllers, the first flies and the second is a standby.
const std::vector<faults::Program> kPrograms = {{faults::Role::kServer, 1},
                                                {faults::Role::kController, 1},
                                                {faults::Role::kController, 2},
                                                {faults::Role::kRecorder, 1}};
const faults::Abilities kAbilities = {
    "chaos", {"kill", "stop"}, {"server-1", "controller-1", "controller-2", "recorder-1"}};

double draw(std::mt19937_64& random, const faults::Span& from) {
  const double drawn = std::uniform_real_distribution<double>(from.least, from.most)(random);
  return std::round(drawn * 100) / 100;
}

faults::Fault choose(std::mt19937_64& random) {
  faults::Fault fault;
  fault.program = kPrograms[random() % 4];
  fault.kind = random() % 2 == 0 ? Kind::kStop : Kind::kKill;
  const bool is_primary =
      fault.program.role == faults::Role::kController && fault.program.number == 1;
  const bool is_for_good = is_primary && random() % 3 == 0;
  if (is_for_good) fault.kind = Kind::kKill;
  fault.at = {0.1, 4.5};  // during start, flight (about 3 s) or end
  fault.for_s = {0.2, 4.0};
  if (fault.kind == Kind::kKill && !is_for_good) fault.restart_s = fault.for_s;
  return fault;
}

/// `fault` with a number in the place of each range.
faults::Fault fix(faults::Fault fault, std::mt19937_64& random) {
  const auto fix_one = [&](faults::Span& span) { span.least = span.most = draw(random, span); };
  fix_one(fault.at);
  fix_one(fault.for_s);
  if (fault.restart_s) fix_one(*fault.restart_s);
  return fault;
}

/// The fault of each case of `file`.
std::vector<faults::Fault> load_faults(const std::string& file) {
  std::vector<faults::Fault> loaded;
  for (const faults::Case& one : faults::load(file, kAbilities)) {
    if (one.faults.size() != 1)
      throw config::ConfigError(file + ": expected one fault in each case, got " +
                                std::to_string(one.faults.size()));
    const faults::Fault& fault = one.faults.front();
    if (fault.kind == Kind::kKill && !fault.restart_s &&
        fault.program.role != faults::Role::kController)
      throw config::ConfigError(fault.place +
                                ".restart_s: missing key; only a controller may stay away");
    loaded.push_back(fault);
  }
  return loaded;
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
  Trial(const std::string& scenario_file, const fs::path& undisturbed, const faults::Fault& fault)
      : scenario_(scenario_file),
        undisturbed_(undisturbed),
        fault_(fault),
        victim_(to_yaml_value(fault.program)),
        is_for_good_(fault.kind == Kind::kKill && !fault.restart_s),
        duration_(fault.restart_s.value_or(fault.for_s).least) {}

  Result run() {
    for (const char* name : {"recorder", "server", "controller", "controller-2"}) start(name);
    const auto began = Clock::now();
    wait_until(
        [&] { return Clock::now() - began >= Seconds(fault_.at.least) || !is_anyone_running(); });
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
  void start(const std::string& name) {
    const int domain = domain_.number();
    const auto start_program = [&](const char* file, std::vector<std::string> flags) {
      processes_.emplace_back(name, std::make_unique<Process>(make_command(file, domain, flags)));
    };
    if (name == "server")
      start_program("sim_server", std::vector<std::string>{"--scenario", scenario_} + kFlags);
    else if (name == "recorder")
      start_program("recorder", {"--out", recording(), "--resume", "--follow"});
    else
      start_program("control_client", {"--scenario", scenario_, "--name", name, "--strength",
                                       name == "controller" ? "2" : "1", "--follow"});
  }

  std::string recording() const { return folder_ / "recording"; }

  Process& current(const std::string& name) const {
    const auto found = std::find_if(processes_.rbegin(), processes_.rend(),
                                    [&](const auto& process) { return process.first == name; });
    return *found->second;
  }

  bool is_anyone_running() const {
    return std::any_of(processes_.begin(), processes_.end(),
                       [](const auto& process) { return process.second->is_running(); });
  }
  bool is_anyone_else_running() const {
    return std::any_of(kPrograms.begin(), kPrograms.end(), [this](const auto& program) {
      const std::string name = to_yaml_value(program);
      return name != victim_ && current(name).is_running();
    });
  }

  /// True once another process has printed the role of the victim since the disturbance.
  bool is_named(const std::vector<std::size_t>& lengths) const {
    const std::string role = victim_.substr(0, victim_.find('-'));
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      if (processes_[i].first == victim_) continue;
      const std::string output = processes_[i].second->output();
      std::istringstream news(output.substr(std::min(lengths[i], output.size())));
      for (std::string line; std::getline(news, line);) {
        const auto message = line.find(": ");  // after the program's own name
        if (message != line.npos && line.find(role, message) != line.npos) return true;
      }
    }
    return false;
  }

  void disturb() {
    std::vector<std::size_t> lengths;
    for (const auto& process : processes_) lengths.push_back(process.second->output().size());
    Process& victim = current(victim_);
    const auto began = Clock::now();
    if (fault_.kind == Kind::kStop)
      victim.send(SIGSTOP);
    else
      victim.kill();

    // No process waits for a standby.
    const bool may_stall = victim_ != "controller-2";
    const auto elapsed = [&] { return Seconds(Clock::now() - began); };
    wait_until(
        [&] {
          if (!result_.named_after && is_named(lengths)) result_.named_after = elapsed();
          return is_for_good_
                     ? result_.named_after || elapsed() > kNamingLimit || !is_anyone_else_running()
                     : elapsed() >= duration_;
        },
        kTrialLimit);
    const bool lasted = elapsed() > kNamingLimit && is_anyone_else_running();
    result_.had_to_be_named = may_stall && lasted;
    if (result_.had_to_be_named &&
        (!result_.named_after || *result_.named_after > Seconds(kNamingLimit)))
      result_.failure = "silent stall: the culprit was not named within 2 s";
    if (fault_.kind == Kind::kStop) victim.send(SIGCONT);
    if (fault_.kind == Kind::kKill && !is_for_good_ && is_anyone_else_running()) start(victim_);
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
    return is_for_good_ && current("server").wait(0s) == 1 &&
           current("server").output().find("not ready within 30 s: 2 controllers (1 ready)") !=
               std::string::npos &&
           Table(fs::path(recording()) / "state.csv").rows() == 0;
  }

  void judge_end() {
    // A process restarted just after the end of the run finds no run: SIGTERM below ends it.
    const auto is_over = [&] {
      return !current("server").is_running() && !current("recorder").is_running();
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
    else if (!is_equal(answer)) {
      std::replace(answer.begin(), answer.end(), '\n', ' ');  // it is a comment
      result_.failure = "the recording is not that of an undisturbed flight: " + answer;
    }
  }

  const std::string scenario_;
  const fs::path undisturbed_;
  const faults::Fault fault_;
  const std::string victim_;  // as the file names it
  const bool is_for_good_;
  const Seconds duration_;
  TemporaryFolder folder_;
  OwnDomain domain_;
  std::vector<std::pair<std::string, std::unique_ptr<Process>>> processes_;
  Result result_;
};

/// The output is a file of faults, with the results as comments. `given`: the faults, one after
/// another; empty: drawn ones.
int run_trials(int trials, std::uint64_t seed, const std::vector<faults::Fault>& given,
               bool is_verbose) {
  TemporaryFolder folder;
  const std::string file = make_scenario(
      folder, {{"controllers: 1", "controllers: 2"}, {"for_s: 32", "for_s: 16"}}, "figure_eight");
  const fs::path undisturbed = fly_in_process(file, folder / "undisturbed", kFlags);
  if (!fs::exists(undisturbed / "manifest.json")) {
    std::cerr << "chaos: error: the undisturbed flight failed\n";
    return 1;
  }

  int failed = 0, had_to_be_named = 0;
  std::printf("cases:\n");
  double slowest_s = 0.0;
  for (int i = 0; i < trials; ++i) {
    std::mt19937_64 random(seed * 1'000'003 + static_cast<std::uint64_t>(i));
    const faults::Fault fault = fix(
        given.empty() ? choose(random) : given[static_cast<std::size_t>(i) % given.size()], random);
    std::printf("  - faults: [%s]  # ", to_line(fault).c_str());
    std::fflush(stdout);
    const auto began = Clock::now();
    Trial trial(file, undisturbed, fault);
    const Result result = trial.run();
    if (result.named_after) {
      if (result.had_to_be_named) slowest_s = std::max(slowest_s, result.named_after->count());
      std::printf("named after %.2f s, ", result.named_after->count());
    }
    had_to_be_named += result.had_to_be_named ? 1 : 0;
    std::printf("ended after %.1f s, %s\n", Seconds(Clock::now() - began).count(),
                result.failure.empty() ? result.success.c_str() : result.failure.c_str());
    if (!result.failure.empty() || is_verbose) std::fputs(trial.outputs().c_str(), stderr);
    std::fflush(stdout);
    failed += result.failure.empty() ? 0 : 1;
  }
  std::printf(
      "# %d trials with seed %llu: %d failed; %d culprits had to be named, the slowest was after "
      "%.2f s\n",
      trials, static_cast<unsigned long long>(seed), failed, had_to_be_named, slowest_s);
  return failed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace sls::test

int main(int argc, char** argv) {
  CLI::App cli(
      "Stops, continues, kills and restarts processes of real flights at random and\nchecks the "
      "results. The output is a file of faults (docs/faults.md).");
  int trials = 10;
  std::uint64_t seed = 1;
  std::string file;
  bool is_verbose = false;
  cli.option_defaults()->always_capture_default();
  auto* number = cli.add_option("--trials", trials, "number of flights")
                     ->type_name("N")
                     ->check(CLI::Range(1, 100000));
  cli.add_option("--seed", seed, "seed of the faults")->type_name("S");
  cli.add_option("--faults", file, "faults (YAML, docs/faults.md), one for each flight")
      ->type_name("FILE")
      ->default_str("");
  cli.add_flag("--verbose", is_verbose, "print the output of the processes");
  CLI11_PARSE(cli, argc, argv);
  try {
    std::vector<sls::config::faults::Fault> given;
    if (!file.empty()) given = sls::test::load_faults(file);
    if (!given.empty() && number->empty()) trials = static_cast<int>(given.size());
    return sls::test::run_trials(trials, seed, given, is_verbose);
  } catch (const sls::config::ConfigError& error) {
    std::cerr << "chaos: error: " << error.what() << '\n';
    return 2;
  }
}
