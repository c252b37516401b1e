/// Pairs of servers for one vehicle that start together, with a client and a recorder.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <thread>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

/// SLS_SERVER_PAIRS=200 makes it a measurement. The pairs follow each other on the same domain.
TEST(ServerPairsTest, OneOfEachFliesAndTheOtherIsRefused) {
  const char* const wanted = std::getenv("SLS_SERVER_PAIRS");
  const Programs programs;
  std::mt19937_64 random(1);
  for (int pair = 1; pair <= (wanted ? std::atoi(wanted) : 4); ++pair) {
    // Half of them start at the same moment, the others up to 0.1 s apart.
    const std::chrono::milliseconds offset(random() % 2 == 0 ? 0 : random() % 100);
    SCOPED_TRACE("pair " + std::to_string(pair) + ", " + std::to_string(offset.count()) + " ms");
    const Words scenario_flags = {"--scenario", scenario("short")};
    const auto recorder =
        programs.start("recorder", {"--out", programs.folder / std::to_string(pair)});
    const auto client = programs.start("control_client", scenario_flags);
    // 100 steps in 2 s: a flight in lockstep could be over before a busy machine starts the other
    // server.
    const auto start = [&] {
      return programs.start("sim_server",
                            scenario_flags + Words{"--period-s", "0.02", "--mode", "realtime"});
    };
    const auto one = start();
    std::this_thread::sleep_for(offset);
    const auto two = start();
    Process& refused = one->wait() == 0 ? *two : *one;
    EXPECT_EQ(refused.wait(), 1);
    for (const char* words : {"vehicle 0: expected no other server", "; a flight of 'short' ("})
      EXPECT_TRUE(holds(refused.output(), words)) << refused.output();
    expect_success({&refused == one.get() ? two.get() : one.get(), client.get(), recorder.get()});
  }
}

}  // namespace
}  // namespace sls::test
