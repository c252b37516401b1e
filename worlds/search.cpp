#include "worlds/search.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "common/app/stop_signal.hpp"

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMostLines = 40;
constexpr auto kReportInterval = 5s;

/// A finding without its numbers, which differ from world to world.
std::string strip_numbers(const std::string& finding) {
  std::string stripped;
  for (std::size_t i = 0; i < finding.size();) {
    const auto count = [&](const char* digits) {
      return std::min(finding.find_first_not_of(digits, i), finding.size()) - i;
    };
    std::size_t length = count("0123456789") > 0 ? count("0123456789.") : 0;
    if (count("0123456789abcdef") >= 16) length = 16;  // a hash
    stripped += length > 0 ? 'N' : finding[i];
    i += std::max<std::size_t>(length, 1);
  }
  return stripped;
}

double find_loss(const Plan& plan) { return plan.hosts > 1 ? plan.link.loss : 0; }
Instant find_delay(const Plan& plan) {
  return plan.hosts > 1 ? plan.link.delay + plan.link.jitter / 2 : Instant(0);
}

std::string make_row(const Plan& plan, const Verdict& verdict) {
  FlightSummary all;
  for (const FlightSummary& flight : verdict.flights) {
    all.duration_s += flight.duration_s;
    all.take_overs += flight.take_overs;
    all.late += flight.late;
    all.worst_error_m = std::max(all.worst_error_m, flight.worst_error_m);
  }
  const bool is_finished = !verdict.flights.empty();
  return fmt::format("{},{:.4f},{:.3f},{},{},{},{},{},{},{}", plan.seed, find_loss(plan),
                     std::chrono::duration<double, std::milli>(find_delay(plan)).count(),
                     plan.faults.size(), verdict.flights.size(),
                     is_finished ? fmt::format("{:.6f}", all.duration_s) : "", all.take_overs,
                     all.late, is_finished ? fmt::format("{:.6f}", all.worst_error_m) : "",
                     verdict.findings.empty() ? 0 : 1);
}

/// One job after another takes the next seed.
class Search {
 public:
  Search(const std::vector<FlownScenario>& scenarios, const SearchOptions& options)
      : scenarios_(scenarios), options_(options), next_(options.first) {}

  SearchResult run(const std::function<void(const SearchResult&)>& report) {
    std::vector<std::thread> threads;
    for (unsigned i = 0; i < options_.jobs; ++i) threads.emplace_back([this, i] { work(i); });
    {
      std::unique_lock lock(mutex_);
      while (!ended_.wait_for(lock, kReportInterval, [this] { return running_ == 0; }))
        report(result_);
    }
    for (std::thread& thread : threads) thread.join();
    return result_;
  }

 private:
  void work(unsigned job) {
    const std::filesystem::path folder = options_.folder / fmt::format("job-{}", job);
    while (true) {
      const std::uint64_t seed = next_++;
      if (seed > options_.last || is_over_ || app::stop_signal() != 0) break;
      fly(seed, folder);
    }
    const std::lock_guard lock(mutex_);
    if (--running_ == 0) ended_.notify_one();
  }

  void fly(std::uint64_t seed, const std::filesystem::path& folder) {
    const Plan plan = draw_plan(seed, scenarios_, options_.cases);
    Verdict verdict = fly_world(plan, scenarios_, folder);
    const bool is_twice = seed % options_.twice_every == 0;
    if (is_twice) {
      const std::uint64_t hash = fly_world(plan, scenarios_, folder).hash;
      if (hash != verdict.hash)
        verdict.findings.push_back(
            fmt::format("same-trace: expected {:016x}, got {:016x}", verdict.hash, hash));
    }
    const std::lock_guard lock(mutex_);
    ++result_.worlds;
    result_.finished += !verdict.flights.empty();
    result_.table.add(plan, verdict);
    result_.complete += static_cast<std::uint64_t>(verdict.complete);
    result_.events += verdict.events;
    result_.steps += verdict.steps;
    result_.simulated_s += verdict.simulated_s;
    result_.planned_faults += plan.faults.size();
    result_.begun_faults += verdict.begun_faults;
    result_.twice += is_twice;
    result_.hash += Random(verdict.hash ^ seed).next();  // in any order
    std::set<std::string> kinds;
    for (const Fault& fault : plan.faults) kinds.insert(config::to_yaml_value(fault.kind));
    for (const std::string& kind : kinds) ++result_.faults[kind];
    if (options_.keeps_rows) result_.rows[seed] = make_row(plan, verdict);
    if (!verdict.findings.empty()) result_.failures[seed] = verdict.findings;
    if (result_.failures.size() >= options_.most_failures) is_over_ = true;
  }

  const std::vector<FlownScenario>& scenarios_;
  const SearchOptions& options_;
  std::atomic<std::uint64_t> next_;
  std::atomic<bool> is_over_{false};
  std::mutex mutex_;
  std::condition_variable ended_;
  unsigned running_ = options_.jobs;  // under the mutex
  SearchResult result_;               // under the mutex
};

/// Tries plans and keeps the smallest that still fails in the same way.
class Shrinker {
 public:
  Shrinker(const Plan& plan, const std::vector<FlownScenario>& scenarios,
           const std::filesystem::path& folder, const std::function<bool()>& is_over)
      : scenarios_(scenarios), folder_(folder), is_over_(is_over), plan_(plan) {
    const auto findings = fly_world(plan, scenarios, folder).findings;
    if (!findings.empty()) broken_ = strip_numbers(findings.front());
  }

  Plan run() {
    for (bool has_shrunk = true; has_shrunk;) {
      has_shrunk = false;
      for (std::size_t i = plan_.faults.size(); i-- > 0;)
        has_shrunk |= attempt([i](Plan& plan) {
          plan.faults.erase(plan.faults.begin() + static_cast<std::ptrdiff_t>(i));
        });
      // Faults name programs by their number, so only the last one can go.
      has_shrunk |=
          plan_.programs.size() > 1 && attempt([](Plan& plan) {
            plan.programs.pop_back();
            const auto is_gone = [&](const Fault& fault) {
              return fault.is_of_program() && fault.target >= plan.programs.size();
            };
            plan.faults.erase(std::remove_if(plan.faults.begin(), plan.faults.end(), is_gone),
                              plan.faults.end());
          });
    }
    attempt([](Plan& plan) { plan.link.loss = plan.link.reordering = plan.link.duplicates = 0; });
    attempt([](Plan& plan) { plan.link = Link(); });
    attempt([](Plan& plan) { plan.drift = plan.wall_offset_s = 0; });
    attempt([](Plan& plan) { plan.has_files = false; });
    for (std::size_t i = 0; i < plan_.programs.size(); ++i) {
      attempt([i](Plan& plan) { plan.programs[i].delay = Instant(0); });
      if (plan_.programs[i].breaks_at)
        attempt([i](Plan& plan) { plan.programs[i].breaks_at.reset(); });
      if (plan_.programs[i].queue != PlannedProgram().queue)
        attempt([i](Plan& plan) { plan.programs[i].queue = PlannedProgram().queue; });
      for (const Trait& trait : kTraits)
        if (plan_.programs[i].*trait.flag)
          attempt([&](Plan& plan) { plan.programs[i].*trait.flag = false; });
    }
    return plan_;
  }

 private:
  template <class Change>
  bool attempt(const Change& change) {
    if (is_over_()) return false;
    Plan smaller = plan_;
    change(smaller);
    const auto findings = fly_world(smaller, scenarios_, folder_).findings;
    const bool is_same = std::any_of(
        findings.begin(), findings.end(),
        [this](const std::string& finding) { return strip_numbers(finding) == broken_; });
    if (is_same) plan_ = smaller;
    return is_same;
  }

  const std::vector<FlownScenario>& scenarios_;
  const std::filesystem::path folder_;
  const std::function<bool()>& is_over_;
  Plan plan_;
  std::string broken_;
};

}  // namespace

void FlightTable::add(const Plan& plan, const Verdict& verdict) {
  const double link_loss = find_loss(plan);
  const Instant link_delay = find_delay(plan);
  const std::size_t loss = (link_loss > 0) + (link_loss > 0.05);
  const std::size_t delay = (link_delay > 1ms) + (link_delay > 5ms);
  Cell& cell = cells[loss][delay];
  ++cell.worlds;
  cell.finished += !verdict.flights.empty();
  for (const FlightSummary& flight : verdict.flights) {
    cell.take_overs += flight.take_overs;
    cell.late += flight.late;
    cell.durations.push_back(flight.duration_s);
    cell.worst_error_m = std::max(cell.worst_error_m, flight.worst_error_m);
  }
}

std::vector<std::string> FlightTable::describe() const {
  std::vector<std::string> lines = {
      "| loss | delay | worlds | finished | simulated s, median | worst | take-overs | late steps "
      "| "
      "worst error m |",
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"};
  for (std::size_t loss = 0; loss < cells.size(); ++loss)
    for (std::size_t delay = 0; delay < cells[loss].size(); ++delay) {
      const Cell& cell = cells[loss][delay];
      if (cell.worlds == 0) continue;
      std::vector<double> sorted = cell.durations;
      std::sort(sorted.begin(), sorted.end());
      const double median = sorted.empty() ? 0 : sorted[sorted.size() / 2];
      lines.push_back(fmt::format("| {} | {} | {} | {} | {:.3f} | {:.3f} | {} | {} | {:.4f} |",
                                  kLosses[loss], kDelays[delay], cell.worlds, cell.finished, median,
                                  sorted.empty() ? 0 : sorted.back(), cell.take_overs, cell.late,
                                  cell.worst_error_m));
    }
  return lines;
}

SearchResult search(const std::vector<FlownScenario>& scenarios, const SearchOptions& options,
                    const std::function<void(const SearchResult&)>& report) {
  return Search(scenarios, options).run(report);
}

Plan shrink(const Plan& plan, const std::vector<FlownScenario>& scenarios,
            const std::filesystem::path& folder, const std::function<bool()>& is_over) {
  return Shrinker(plan, scenarios, folder, is_over).run();
}

std::vector<std::string> tell(const Plan& plan, const std::vector<FlownScenario>& scenarios,
                              const std::filesystem::path& folder) {
  std::vector<std::string> lines = describe(plan);
  if (lines.size() > kMostLines / 2) lines.resize(kMostLines / 2);
  std::vector<std::string> events;
  for (const std::string& line : fly_world(plan, scenarios, folder, true).trace)
    if (line.find("status ") == std::string::npos) events.push_back(line);
  const std::size_t room = kMostLines - lines.size();
  const std::size_t left_out = events.size() > room ? events.size() - room + 1 : 0;
  if (left_out > 0) lines.push_back(fmt::format("… {} earlier lines", left_out));
  lines.insert(lines.end(), events.begin() + static_cast<std::ptrdiff_t>(left_out), events.end());
  return lines;
}

}  // namespace sls::worlds
