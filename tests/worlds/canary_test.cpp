// The worlds with a defect in a core: CMakeLists.txt puts it in. If they find nothing, they test nothing.
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"
#include "worlds/scenarios.hpp"
#include "worlds/search.hpp"

namespace sls::worlds {
namespace {

TEST(CanaryTest, ADefectInACoreIsFound) {
  const test::TemporaryFolder folder;
  SearchOptions options;
  options.last = 1999;
  options.jobs = 2;
  options.most_failures = 1;
  options.folder = folder.path();
  const SearchResult result = search(make_scenarios(), options, [](const SearchResult&) {});
  ASSERT_FALSE(result.failures.empty()) << result.worlds << " worlds";
  EXPECT_EQ(result.failures.begin()->second.front().rfind("strongest: ", 0), 0u)
      << result.failures.begin()->second.front();
}

}  // namespace
}  // namespace sls::worlds
