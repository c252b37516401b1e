#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <string>
#include <thread>

#include "common/app/log.hpp"
#include "common/app/run_error.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "worlds/scenarios.hpp"
#include "worlds/search.hpp"

namespace {

using namespace sls;

constexpr auto kLongestShrinking = std::chrono::seconds(60);

/// Files of worlds are in memory: a world writes and reads them in milliseconds.
class Folder {
 public:
  Folder() { std::filesystem::create_directories(path_); }
  ~Folder() {
    std::error_code none;
    std::filesystem::remove_all(path_, none);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  const std::filesystem::path path_ = fmt::format("/dev/shm/sls_worlds_{}", ::getpid());
};

/// "A-B" or "A".
void parse_seeds(const std::string& text, worlds::SearchOptions& options) {
  const auto is_number = [](const std::string& word) {
    return !word.empty() && word.size() <= 18 &&
           word.find_first_not_of("0123456789") == std::string::npos;
  };
  const std::size_t dash = text.find('-');
  const std::string first = text.substr(0, dash);
  const std::string last = dash == std::string::npos ? first : text.substr(dash + 1);
  if (!is_number(first) || !is_number(last) || std::stoull(last) < std::stoull(first))
    throw config::ConfigError("--seeds: expected A-B with A ≤ B, such as 0-9999, got '" + text +
                              "'");
  options.first = std::stoull(first);
  options.last = std::stoull(last);
}

void print_result(const worlds::SearchResult& result, double wall_s) {
  const auto worlds = static_cast<double>(std::max<std::uint64_t>(result.worlds, 1));
  std::cout << fmt::format(
      "{} worlds, {} failed; {:.0f} worlds/s; trace {:016x}\n"
      "a flight was finished in {}, {} recordings are complete, {} worlds were flown twice\n"
      "of each: {:.1f} s simulated, {:.0f} events, {:.0f} steps\n",
      result.worlds, result.failures.size(), worlds / wall_s, result.hash, result.finished,
      result.complete, result.twice, result.simulated_s / worlds,
      static_cast<double>(result.events) / worlds, static_cast<double>(result.steps) / worlds);
  std::string faults;
  for (const auto& [kind, count] : result.faults)
    faults += fmt::format("{}{} {}", faults.empty() ? "" : ", ", kind, count);
  std::cout << fmt::format("worlds with a fault: {}; {} of {} faults began\n",
                           faults.empty() ? "none" : faults, result.begun_faults,
                           result.planned_faults);
  for (const std::string& line : result.table.describe()) app::print(line);
}

void print_story(const worlds::Plan& plan, const std::vector<worlds::FlownScenario>& scenarios,
                 const std::filesystem::path& folder) {
  for (const std::string& line : worlds::tell(plan, scenarios, folder)) app::print("  " + line);
}

}  // namespace

int main(int argc, char** argv) {
  app::CommandLine cli(
      "Flies simulated worlds: server, clients and recorders with faults, from a seed.");
  app::CommonOptions common;
  common.log_level = "error";  // the programs of a world write into its trace
  std::filesystem::path scenario, faults;
  std::string seeds = "0-999";
  worlds::SearchOptions options;
  options.jobs = std::max(1u, std::thread::hardware_concurrency());
  std::filesystem::path table;
  std::optional<std::uint64_t> replayed;
  bool is_verbose = false;
  cli.footer(
      "./sls worlds also takes --plot FILE (.png, .svg, .pdf): time and error of the flights over "
      "the loss.");
  cli.add_option(
         "--scenario", scenario,
         "scenario (YAML) that every world flies (default: 23 short ones, with both modes and "
         "all policies)")
      .type_name("FILE");
  cli.add_option("--faults", faults,
                 "link and faults (YAML, docs/faults.md) of every world, instead of drawn ones")
      .type_name("FILE");
  cli.add_option("--seeds", seeds, "worlds to fly").type_name("A-B");
  cli.add_option("--jobs", options.jobs, "threads (default: one for each processor)")
      .range(1, 256)
      .type_name("N");
  cli.add_option("--most", options.most_failures, "end after so many failed worlds")
      .range(1, 1000)
      .type_name("N");
  cli.add_option("--table", table, "write a CSV file with one row for each world")
      .type_name("FILE");
  const auto replay =
      cli.add_option("--replay", replayed, "tell what happens in the world of this seed")
          .type_name("SEED");
  cli.add_flag("--verbose", is_verbose, "the whole world, with every status").needs(replay);

  return app::run_main(argc, argv, cli, common, "sls_worlds", [&] {
    parse_seeds(seeds, options);
    if (!faults.empty()) options.cases = config::faults::load(faults, worlds::list_abilities());
    const Folder folder;
    options.folder = folder.path();
    std::ofstream rows;
    options.keeps_rows = !table.empty();
    if (options.keeps_rows) {
      rows.open(table);
      if (!rows) throw config::ConfigError(table.string() + ": expected a file to write, got none");
    }
    const auto scenarios =
        scenario.empty()
            ? worlds::make_scenarios()
            : std::vector<worlds::FlownScenario>{worlds::fly(config::load_scenario(scenario))};
    if (!scenario.empty() && !scenarios.front().failure.empty())
      throw config::ConfigError(
          fmt::format("{}: expected a flight that finishes in one process, got: step {}: {}",
                      scenario.string(), scenarios.front().last_step, scenarios.front().failure));
    if (replayed) {
      const worlds::Plan plan = worlds::draw_plan(*replayed, scenarios, options.cases);
      if (!is_verbose) return print_story(plan, scenarios, folder.path());
      for (const std::string& line : worlds::describe(plan)) app::print(line);
      for (const std::string& line :
           worlds::fly_world(plan, scenarios, folder.path() / "replay", true).trace)
        app::print(line);
      return;
    }
    const auto began = std::chrono::steady_clock::now();
    const auto measure = [&] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    };
    const worlds::SearchResult result =
        worlds::search(scenarios, options, [&](const worlds::SearchResult& so_far) {
          std::cerr << fmt::format("sls_worlds: {} of {} worlds, {} failed, {:.0f} worlds/s\n",
                                   so_far.worlds, options.last - options.first + 1,
                                   so_far.failures.size(),
                                   static_cast<double>(so_far.worlds) / measure());
        });
    print_result(result, measure());
    if (options.keeps_rows) {
      rows << worlds::kRowNames << '\n';
      for (const auto& [seed, row] : result.rows) rows << row << '\n';
      if (!rows.flush()) throw app::RunError(table.string() + ": cannot be written");
    }
    for (const auto& [seed, findings] : result.failures) {
      std::cout << fmt::format("seed {}:\n", seed);
      for (const std::string& finding : findings) app::print("  " + finding);
    }
    if (result.failures.empty() || app::stop_signal() != 0) return;
    const std::uint64_t first = result.failures.begin()->first;
    std::cout << fmt::format("the world of seed {}, without what it does not need:\n", first)
              << std::flush;
    const auto give_up = std::chrono::steady_clock::now() + kLongestShrinking;
    bool is_over = false;
    const worlds::Plan smallest = worlds::shrink(
        worlds::draw_plan(first, scenarios, options.cases), scenarios, folder.path() / "shrink",
        [&] {
          is_over |= app::stop_signal() != 0 || std::chrono::steady_clock::now() >= give_up;
          return is_over;
        });
    if (is_over) std::cout << "  (the search for what it does not need was ended)\n";
    print_story(smallest, scenarios, folder.path() / "tell");
    std::cout << std::flush;  // the error comes last
    throw app::RunError(
        fmt::format("{} of {} worlds failed", result.failures.size(), result.worlds));
  });
}
