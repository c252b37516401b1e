/// Multirotors in the real programs: one result in every mode, fleets, and printed messages.
#include <gtest/gtest.h>

#include "tests/system/fleet_flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

class MultirotorSystemTest : public ::testing::Test {
 protected:
  fs::path fly_in_process(const std::string& file, const std::string& name,
                          const std::vector<std::string>& flags = {}) const {
    return test::fly_in_process(file, folder_ / name, flags);
  }

  const TemporaryFolder folder_;
};

TEST_F(MultirotorSystemTest, ThePublishedFlightHasOneResult) {
  const std::string file = scenario("px4_published");
  const fs::path once = fly_in_process(file, "once");
  const std::string certificate = read_certificate(once);
  EXPECT_EQ(certificate.size(), 64u);
  EXPECT_EQ(read_certificate(fly_in_process(file, "again", {"--check-purity"})), certificate);

  Flight over_udp(file, {qos("udp"), {}, {}});
  over_udp.expect_success();
  EXPECT_EQ(read_certificate(over_udp.recording()), certificate);
  for (const char* name : {"state.csv", "measured.csv", "reference.csv"})
    EXPECT_EQ(read_file(once / name), read_file(over_udp.recording() / name)) << name;
  EXPECT_TRUE(Table(once / "state.csv").is_well_formed());
}

TEST_F(MultirotorSystemTest, InAFleetEachFliesAsAlone) {
  const std::string file = make_scenario(
      folder_,
      {{"for_s: 10", "for_s: 1"}, {"for_s: 32", "for_s: 4"}, {"mission:", "vehicles: 3\nmission:"}},
      "px4_fitted");
  const fs::path in_process = fly_in_process(file, "in_process");
  expect_each_flies_as_alone(in_process, file, {0, 1, 2});
  Flight flight(file);
  flight.expect_success();
  EXPECT_EQ(read_certificate(flight.recording()), read_certificate(in_process));
  EXPECT_EQ(read_file(flight.recording() / "state.csv"), read_file(in_process / "state.csv"));
}

// --- messages ------------------------------------------------------------------------------------

void expect_said(const fs::path& recording, const std::string& remark) {
  EXPECT_TRUE(holds(read_file(recording / "flight.txt"), remark))
      << read_file(recording / "flight.txt");
  EXPECT_TRUE(holds(read_file(recording / "status.csv"), remark))
      << read_file(recording / "status.csv");
}

TEST_F(MultirotorSystemTest, RotorsAtTheirLargestSpeedAreAnEventOfTheRecording) {
  // Hovering requires 913 rad/s. The load begins 2 m below the eight.
  const std::string file =
      make_scenario(folder_,
                    {{"max_speed_rad_s: 1100", "max_speed_rad_s: 950"},
                     {"load_position_m: [0, 0, -0.5]", "load_position_m: [0, 0, 1.5]"},
                     {"for_s: 32", "for_s: 3"}},
                    "multirotor_figure_eight");
  const std::string remark =
      "vehicle 0: rotor 2 at its largest speed (950 rad/s) for more than 1 s, since ";
  const fs::path in_process = fly_in_process(file, "in_process");
  expect_said(in_process, remark);
  Flight flight(file);
  flight.expect_success();
  expect_said(flight.recording(), remark);
  EXPECT_TRUE(holds(flight.server->output(), remark)) << flight.server->output();
  EXPECT_EQ(read_certificate(flight.recording()), read_certificate(in_process));
}

TEST_F(MultirotorSystemTest, WithoutAuthorityOverYawItWarnsAndFlies) {
  const std::string remark = "vehicle 0: the rotors have no authority over yaw";
  std::string file;
  for (const std::string name : {"multirotor_figure_eight", "multirotor_geometric"}) {
    SCOPED_TRACE(name);
    file = make_scenario(
        folder_, {{"torque_constant_m: 0.05", "torque_constant_m: 0"}, {"for_s: 32", "for_s: 4"}},
        name);
    const fs::path in_process = fly_in_process(file, name);
    expect_said(in_process, remark);
    EXPECT_LE(calc_tracking_error(in_process, 500, 999).max.norm(), 1.0);
  }
  Flight flight(file);
  flight.expect_success();
  expect_said(flight.recording(), remark);
}

}  // namespace
}  // namespace sls::test
