// The worlds with a defect in a core: CMakeLists.txt puts it in. If they find nothing, they test
// nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "worlds/scenarios.hpp"
#include "worlds/search.hpp"
#include "worlds/world.hpp"

namespace sls::worlds {
namespace {

bool breaks_strongest(const std::vector<std::string>& findings) {
  return std::any_of(findings.begin(), findings.end(), [](const std::string& finding) {
    return finding.rfind("strongest: ", 0) == 0;
  });
}

TEST(CanaryTest, ADefectInACoreIsFoundInAWorldThatShrinksToWhatItNeeds) {
  const test::TemporaryFolder folder;
  SearchOptions options;
  options.last = 1999;
  options.jobs = 2;
  options.most_failures = 1;
  options.folder = folder.path();
  const auto scenarios = make_scenarios();
  const SearchResult result = search(scenarios, options, [](const SearchResult&) {});
  ASSERT_FALSE(result.failures.empty()) << result.worlds << " worlds";
  const auto& [seed, findings] = *result.failures.begin();
  EXPECT_EQ(findings.front().rfind("strongest: ", 0), 0u) << findings.front();

  const Plan plan = draw_plan(seed, scenarios, options.cases);
  EXPECT_EQ(describe(shrink(plan, scenarios, folder / "at_once", [] { return true; })),
            describe(plan));
  const Plan smallest = shrink(plan, scenarios, folder / "shrink", [] { return false; });
  EXPECT_LT(describe(smallest).size(), describe(plan).size());
  EXPECT_TRUE(breaks_strongest(fly_world(smallest, scenarios, folder / "smallest").findings));
}

}  // namespace
}  // namespace sls::worlds
