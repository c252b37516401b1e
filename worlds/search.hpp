#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "worlds/world.hpp"

namespace sls::worlds {

struct SearchOptions {
  std::uint64_t first = 0;
  std::uint64_t last = 9999;  ///< inclusive
  unsigned jobs = 1;
  std::uint64_t twice_every = 10;           ///< one of so many worlds is flown twice
  std::filesystem::path folder;             ///< for files of worlds; each job has its own in it
  std::size_t most_failures = 10;           ///< the search ends after these
  bool keeps_rows = false;                  ///< one per world, for a table
  std::vector<config::faults::Case> cases;  ///< of a file of faults; empty: drawn ones
};

/// The flights of worlds with about the same network.
struct FlightTable {
  static constexpr std::array<const char*, 3> kLosses = {"0", "up to 5 %", "more"};
  static constexpr std::array<const char*, 3> kDelays = {"up to 1 ms", "up to 5 ms", "more"};
  struct Cell {
    std::uint64_t worlds = 0;
    std::uint64_t finished = 0;  ///< worlds with a finished flight
    std::uint64_t take_overs = 0;
    std::uint64_t late = 0;         ///< steps
    std::vector<double> durations;  ///< of finished flights, simulated s
    double worst_error_m = 0;
  };
  std::array<std::array<Cell, 3>, 3> cells;  ///< by loss and delay of the link

  void add(const Plan& plan, const Verdict& verdict);
  /// A line for each cell that has worlds.
  std::vector<std::string> describe() const;
};

/// The findings of a search. It does not depend on the number of jobs, unless it ended early.
struct SearchResult {
  std::uint64_t worlds = 0;
  std::uint64_t finished = 0;  ///< in which a flight was finished
  std::uint64_t complete = 0;  ///< recordings
  std::uint64_t events = 0;
  std::uint64_t steps = 0;
  double simulated_s = 0;
  std::uint64_t twice = 0;                      ///< flown twice, with equal traces
  std::uint64_t hash = 0;                       ///< of the traces of all worlds
  std::map<std::string, std::uint64_t> faults;  ///< worlds with this kind
  std::uint64_t planned_faults = 0;
  std::uint64_t begun_faults = 0;                              ///< before the end of all faults
  std::map<std::uint64_t, std::vector<std::string>> failures;  ///< findings by seed
  FlightTable table;
  std::map<std::uint64_t, std::string> rows;  ///< kRowNames of each world, if they are kept
};

/// The columns of `SearchResult::rows`. Loss and delay are those of the links between hosts, from 0
/// to 1 and in ms. Of the finished flights of a world: simulated time and largest load error.
inline constexpr const char* kRowNames =
    "seed,loss,delay_ms,faults,finished,duration_s,take_overs,late_steps,worst_error_m,failed";

/// Flies the worlds of all seeds. `report(result)` is called every few seconds.
SearchResult search(const std::vector<FlownScenario>& scenarios, const SearchOptions& options,
                    const std::function<void(const SearchResult&)>& report);

/// The smallest plan that still breaks a property that `plan` breaks: without faults, programs and
/// noise that it does not need. Once `is_over()`, the smallest that was found: it is asked before
/// each world.
Plan shrink(const Plan& plan, const std::vector<FlownScenario>& scenarios,
            const std::filesystem::path& folder, const std::function<bool()>& is_over);

/// The world of `plan` in at most 40 lines: what it is made of, and the events before the finding.
std::vector<std::string> tell(const Plan& plan, const std::vector<FlownScenario>& scenarios,
                              const std::filesystem::path& folder);

}  // namespace sls::worlds
