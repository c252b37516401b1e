#include "common/bus/sync_counters.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <regex>
#include <stdexcept>

namespace sls::bus {
namespace {

/// The fields of SyncCounters in the contract, by name.
std::vector<std::string> read_contract() {
  std::ifstream file(SLS_SOURCE_DIR "/idl/sls.idl");
  std::vector<std::string> names;
  bool is_inside = false;
  for (std::string line; std::getline(file, line);) {
    if (line.find("struct SyncCounters {") != line.npos) is_inside = true;
    if (line.find("};") != line.npos) is_inside = false;
    std::smatch field;
    if (is_inside && std::regex_search(line, field, std::regex(R"(unsigned long long (\w+);)")))
      names.push_back(field[1]);
  }
  std::sort(names.begin(), names.end());
  return names;
}

TEST(SyncCountersTest, TheTableHasEveryFieldOfTheContractOnce) {
  std::vector<std::string> names;
  for (const SyncCounter& counter : kSyncCounters) names.emplace_back(counter.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, read_contract());
}

TEST(SyncCountersTest, EachCounterIsAddedToItsOwn) {
  SyncCounters sum, counters;
  counters.resent(3);
  counters.rejected_fault(40);
  sum.resent(100);
  sum.slipped(7);
  add(sum, counters);
  SyncCounters expected;
  expected.resent(103);
  expected.rejected_fault(40);
  expected.slipped(7);
  EXPECT_EQ(sum, expected);
}

TEST(SyncCountersTest, CountsAreFoundByTheirWords) {
  SyncCounters counters;
  counters.fail_safe(5);
  counters.rejected_not_finite(6);
  EXPECT_EQ(list_counts(counters, "", {"fail-safe"}).front().value, 5u);
  EXPECT_EQ(list_counts(counters, "rejected_", {"not finite"}).front().value, 6u);
  EXPECT_THROW(list_counts(counters, "", {"failsafe"}), std::logic_error);
}

}  // namespace
}  // namespace sls::bus
