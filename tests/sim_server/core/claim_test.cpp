#include "sim_server/core/participants/claim.hpp"

#include <gtest/gtest.h>

#include "tests/common/sync/samples.hpp"

namespace sls::sim {
namespace {

/// Another server's run of vehicles 4 and 7.
std::vector<sync::Run> other(std::uint64_t run_id, std::optional<RunPhase> phase) {
  sync::Run run;
  run.parameters = sync::claim(run_id, {4, 7});
  if (phase) run.status = sync::status(run_id, *phase);
  return {run};
}

TEST(RivalTest, OfTwoServersThatAreAsFarTheLowerRunIdFlies) {
  EXPECT_EQ(describe_rival(other(499, std::nullopt), 500, {3, 7}, 0),
            "vehicle 7: expected no other server on this domain, got one (run 00000000000001f3)");
  EXPECT_EQ(describe_rival(other(501, std::nullopt), 500, {3, 7}, 0), "");
}

TEST(RivalTest, AServerThatIsFurtherFliesWhateverItsRunId) {
  EXPECT_NE(describe_rival(other(501, RunPhase::PHASE_WAITING), 500, {7}, 0), "");
  EXPECT_NE(describe_rival(other(501, RunPhase::PHASE_PAUSED), 500, {7}, 1), "");
  EXPECT_EQ(describe_rival(other(499, RunPhase::PHASE_WAITING), 500, {7}, 2), "");
}

TEST(RivalTest, OtherVehiclesAndRunsThatHaveEndedAreNoRivals) {
  EXPECT_EQ(describe_rival(other(499, RunPhase::PHASE_RUNNING), 500, {3, 5}, 0), "");
  for (const RunPhase ended :
       {RunPhase::PHASE_FINISHED, RunPhase::PHASE_FAILED, RunPhase::PHASE_RESET})
    EXPECT_EQ(describe_rival(other(499, ended), 500, {7}, 0), "");
}

}  // namespace
}  // namespace sls::sim
