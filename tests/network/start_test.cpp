/// Starts of flights on a network that loses a fifth of its packets: discovery then takes seconds,
/// and no program may take that for a mistake of another one.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>

#include "tests/network/hosts_flight.hpp"

namespace sls::test {
namespace {

using namespace std::chrono_literals;

class StartTest : public HostsTest {
 protected:
  /// The lines of `text` that name a mistake.
  static std::string find_mistakes(const std::string& text) {
    std::istringstream lines(text);
    std::string mistakes;
    for (std::string line; std::getline(lines, line);)
      if (line.find(": warning: ") != line.npos && line.find("expected") != line.npos)
        mistakes += line + "\n";
    return mistakes;
  }
};

/// SLS_LOSSY_STARTS=100 makes it a measurement; five at a time.
TEST_F(StartTest, HealthyStartsWithTwentyPercentLossGiveNoFalseLine) {
  const char* const wanted = std::getenv("SLS_LOSSY_STARTS");
  const int starts = wanted ? std::atoi(wanted) : 3;
  network_->lose(0.2);
  const Profile profile(*network_, "wifi");
  const TemporaryFolder folder;
  const std::string file = make_scenario(folder, {{"timeout_s: 30", "timeout_s: 120"}});
  for (int first = 0; first < starts; first += 5) {
    std::vector<std::unique_ptr<Flight>> flights;
    for (int i = first; i < std::min(first + 5, starts); ++i)
      flights.push_back(std::make_unique<Flight>(file, profile.flight_options()));
    for (const auto& flight : flights) {
      EXPECT_TRUE(wait_until([&] { return flight->wait_for_steps(1); }, 120s)) << flight->outputs();
      EXPECT_EQ(find_mistakes(flight->outputs()), "") << flight->outputs();
    }
  }
  EXPECT_GT(network_->lost(), 100u);
}

}  // namespace
}  // namespace sls::test
