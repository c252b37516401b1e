// The worlds of many seeds, and what a search says of them.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "worlds/scenarios.hpp"
#include "worlds/search.hpp"

namespace sls::worlds {
namespace {

// 20,000 find few defects more (docs/worlds.md); `./sls worlds --seeds 0-99999` before a release.
constexpr std::uint64_t kWorlds = 3'000;

class WorldsTest : public testing::Test {
 protected:
  static const std::vector<FlownScenario>& scenarios() {
    static const std::vector<FlownScenario> made = make_scenarios();
    return made;
  }
  SearchResult search(std::uint64_t first, std::uint64_t last, unsigned jobs) {
    SearchOptions options;
    options.first = first;
    options.last = last;
    options.jobs = jobs;
    options.folder = folder_.path();
    return worlds::search(scenarios(), options, [](const SearchResult&) {});
  }
  static std::string describe(const SearchResult& result) {
    std::string text;
    for (const auto& [seed, findings] : result.failures)
      text += "seed " + std::to_string(seed) + ": " + findings.front() + "\n";
    return text;
  }

  const test::TemporaryFolder folder_;
};

TEST_F(WorldsTest, EveryPropertyHoldsInEveryWorld) {
  const SearchResult result =
      search(0, kWorlds - 1, std::max(2u, std::thread::hardware_concurrency()));
  EXPECT_EQ(describe(result), "");
  EXPECT_EQ(result.worlds, kWorlds);
  // The worlds try something: most flights get through, and every kind of fault happens.
  EXPECT_GT(result.finished, kWorlds * 7 / 10);
  EXPECT_GT(result.complete, kWorlds * 7 / 10);
  EXPECT_EQ(result.faults.size(), names_of(config::faults::Kind()).size());
  for (const auto& [kind, count] : result.faults) {
    const bool is_rare = kind == "refuse" || kind == "block";
    EXPECT_GT(count, kWorlds / (is_rare ? 50 : 12)) << kind;
  }
}

TEST_F(WorldsTest, SeedsThatFailedOnceHold) {
  std::ifstream lines(SLS_SOURCE_DIR "/worlds/seeds.txt");
  ASSERT_TRUE(lines);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.front() == '#') continue;
    const std::uint64_t seed = std::stoull(line);
    EXPECT_EQ(describe(search(seed, seed, 1)), "") << line;
  }
}

TEST_F(WorldsTest, ASeedHasOneTraceWithAnyNumberOfJobs) {
  const SearchResult one = search(0, 199, 1);
  const SearchResult four = search(0, 199, 4);
  EXPECT_EQ(one.hash, four.hash);
  EXPECT_NE(one.hash, search(1, 200, 4).hash);
}

}  // namespace
}  // namespace sls::worlds
