/// One scenario, one result: no disturbance of a lockstep flight changes its certificate.
#include <gtest/gtest.h>
#include <sched.h>

#include "tests/system/flight.hpp"
#include "tests/system/load.hpp"

namespace sls::test {
namespace {

/// While it exists, new processes run only on the first core.
class OneCore {
 public:
  OneCore() {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t one;
    CPU_ZERO(&one);
    for (int core = 0; core < CPU_SETSIZE; ++core)
      if (CPU_ISSET(core, &before_)) {
        CPU_SET(core, &one);
        break;
      }
    sched_setaffinity(0, sizeof one, &one);
  }
  ~OneCore() { sched_setaffinity(0, sizeof before_, &before_); }

 private:
  cpu_set_t before_{};
};

class OneResultTest : public ::testing::Test {
 protected:
  void expect_same(const FlightOptions& options = {}) {
    flight_ = std::make_unique<Flight>(file_, options);
    flight_->expect_success();
    expect_undisturbed(flight_->recording(), file_);
  }

  const TemporaryFolder folder_;
  const std::string file_ = make_scenario(folder_, {{"for_s: 32", "for_s: 16"}}, "figure_eight");
  std::unique_ptr<Flight> flight_;
};

TEST_F(OneResultTest, OnOneCoreThatIsBusy) {
  const OneCore one_core;
  const Load load(1);
  expect_same();
}

TEST_F(OneResultTest, WithFivePercentOfAllDatagramsLost) {
  const std::vector<std::string> lossy = {"env", std::string("LD_PRELOAD=") + SLS_DROP_SHIM,
                                          "SLS_DROP_PERCENT=5", "SLS_DROP_SEED=1"};
  FlightOptions options{qos("udp"), {}, {}};
  for (const char* name : {"recorder", "sim_server", "control_client"})
    options.before[name] = lossy;
  expect_same(options);
  const std::string said = flight_->server->output();
  const auto at = said.find("drop_shim: lost ");
  ASSERT_NE(at, std::string::npos) << "the shim was not loaded: " << said;
  EXPECT_GT(std::stoi(said.substr(at + 16)), 100) << said;
}

// --- sensing -------------------------------------------------------------------------------------

TEST(SensingSystemTest, AFleetHasTheSameResultInProcess) {
  TemporaryFolder folder;
  const std::string file = make_scenario(
      folder,
      {{"mission:", "sensing: { period_s: 0.007, age_s: 0.0033, node_delay_s: 0.0015 }\nmission:"}},
      "mixed_fleet");
  Flight flight(file);
  flight.expect_success();
  const auto alone = fly_in_process(file, folder / "alone");
  EXPECT_EQ(read_certificate(flight.recording()), read_certificate(alone));
  EXPECT_EQ(read_file(flight.recording() / "measured.csv"), read_file(alone / "measured.csv"));
}

}  // namespace
}  // namespace sls::test
