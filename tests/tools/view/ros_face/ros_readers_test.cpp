/// Reads real flights on the rt/… topics of `sls_view --ros` with Eclipse Cyclone DDS, as ROS 2
/// nodes do (ros_reader.c), and compares them with the recording.
#include <gtest/gtest.h>
#include <signal.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>

#include "fastdds_files.hpp"
#include "tests/system/flight.hpp"
#include "tests/tools/view/live/fake_server.hpp"

namespace sls::test {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using nlohmann::json;

constexpr double kRounding = 1e-12;  // of rotated velocities up to some m/s
constexpr double kPeriodNs = 4e6;

/// Cyclone DDS on loopback only, like the profile `default`.
const Words kOnLoopback = {
    "env",
    "CYCLONEDDS_URI=<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\" "
    "multicast=\"true\"/></Interfaces></General></Domain></CycloneDDS>"};

// Hashes that ROS 2 Iron to Kilted announce. Sources: tests/common/ros/type_hash_test.py.
const std::map<std::string, std::string> kTypeHashes = {
    {"rosgraph_msgs::msg::dds_::Clock_",
     "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"},
    {"tf2_msgs::msg::dds_::TFMessage_",
     "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
    {"nav_msgs::msg::dds_::Odometry_",
     "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    {"geometry_msgs::msg::dds_::PoseStamped_",
     "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"},
    {"visualization_msgs::msg::dds_::MarkerArray_",
     "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"}};

std::map<std::string, std::string> list_expected_types(const std::vector<int>& vehicle_ids) {
  const std::string odometry = "nav_msgs::msg::dds_::Odometry_",
                    pose = "geometry_msgs::msg::dds_::PoseStamped_";
  std::map<std::string, std::string> types = {{"rt/clock", "rosgraph_msgs::msg::dds_::Clock_"},
                                              {"rt/tf", "tf2_msgs::msg::dds_::TFMessage_"},
                                              {"rt/tf_static", "tf2_msgs::msg::dds_::TFMessage_"}};
  for (const int id : vehicle_ids) {
    const std::string prefix = "rt/sls/vehicle_" + std::to_string(id) + "/";
    types[prefix + "quadrotor/odometry"] = odometry;
    types[prefix + "load/odometry"] = odometry;
    types[prefix + "quadrotor/pose"] = pose;
    types[prefix + "load/pose"] = pose;
    types[prefix + "load/reference"] = pose;
    types[prefix + "markers"] = "visualization_msgs::msg::dds_::MarkerArray_";
  }
  return types;
}

Vector3d to_vector(const json& list) {
  return Vector3d(list.at(0).get<double>(), list.at(1).get<double>(), list.at(2).get<double>());
}
Quaterniond to_quaternion(const json& list) {
  return Quaterniond(list.at(0).get<double>(), list.at(1).get<double>(), list.at(2).get<double>(),
                     list.at(3).get<double>());
}
/// From W (z down) to world (z up), or from the body's frame (z down) to the one with z up.
Vector3d turn(const Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }

/// The record of a vehicle at a step, in the frames of the recording.
struct Row {
  Vector3d p_WQ, v_WQ, p_WL, v_WL, w_WB_B;
  Quaterniond q_WB;
};

Vector3d read_vector(const Table& table, std::size_t row, const std::string& before,
                     const std::string& behind) {
  return {table.number(row, before + "x" + behind), table.number(row, before + "y" + behind),
          table.number(row, before + "z" + behind)};
}

std::map<std::pair<int, std::int64_t>, Row> read_rows(const std::filesystem::path& recording) {
  const Table table(recording / "state.csv");
  std::map<std::pair<int, std::int64_t>, Row> rows;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    Row row;
    row.p_WQ = table.position(i, "quad");
    row.v_WQ = read_vector(table, i, "quad_v", "_m_s");
    row.p_WL = table.position(i, "load");
    row.v_WL = read_vector(table, i, "load_v", "_m_s");
    row.w_WB_B = read_vector(table, i, "rate_", "_rad_s");
    row.q_WB = {table.number(i, "att_w"), table.number(i, "att_x"), table.number(i, "att_y"),
                table.number(i, "att_z")};
    rows[{static_cast<int>(table.number(i, "vehicle_id")),
          static_cast<std::int64_t>(table.number(i, "step"))}] = row;
  }
  return rows;
}

class RosReadersTest : public ProgramsTest {
 protected:
  void SetUp() override {
    if (!SLS_HAS_CYCLONE)
      GTEST_SKIP() << "built without Cyclone DDS: apt-get install cyclonedds-dev cyclonedds-tools";
  }

  /// Starts viewer and reader; they have discovered each other before a flight starts.
  void start_watching(const Words& vehicles) {
    view_ = start("sls_view", {"--ros", "--port", "0"});
    reader_ =
        std::make_unique<Process>(kOnLoopback + Words{SLS_ROS_READER, domain.text()} + vehicles);
    ASSERT_TRUE(wait_for("{\"topic\":\"rt/tf_static\"")) << outputs();
  }

  void start_flight(const std::string& scenario_file, const Words& server_flags) {
    const Words flags = {"--scenario", scenario_file};
    client_ = start("control_client", flags);
    recorder_ = start("recorder", {"--out", recording_});
    server_ = start("sim_server", flags + server_flags);
  }

  void expect_flight_to_end_well() {
    for (Process* process : {server_.get(), client_.get(), recorder_.get()})
      EXPECT_EQ(process->wait(), 0) << outputs();
  }

  void stop_watching() {
    for (Process* process : {reader_.get(), view_.get()}) process->send(SIGTERM);
    EXPECT_EQ(reader_->wait(), 0) << outputs();
    EXPECT_EQ(view_->wait(), 128 + SIGTERM) << outputs();
  }

  bool wait_for(const std::string& text) const {
    return wait_until([&] { return reader_->output().find(text) != std::string::npos; });
  }

  /// Complete lines of the reader that begin with `key`, and have the value `topic` if it is given.
  std::vector<json> find_lines(const std::string& key, const std::string& topic = {}) const {
    std::vector<json> found;
    std::istringstream lines(reader_->output());
    for (std::string line; std::getline(lines, line) && !lines.eof();) {
      if (line.find("{\"" + key + "\":\"" + topic) != 0) continue;
      const json parsed = json::parse(line);
      if (topic.empty() || parsed.at(key) == topic) found.push_back(parsed);
    }
    return found;
  }

  std::string outputs() const {
    std::string text;
    for (const Process* process : {view_.get(), reader_.get(), server_.get(), client_.get()})
      if (process) text += process->output() + "\n";
    return text;
  }

  const std::string recording_ = recording();
  std::unique_ptr<Process> view_, reader_, recorder_, server_, client_;
};

void expect_near(const json& actual, const Vector3d& expected) {
  EXPECT_LT((to_vector(actual) - expected).norm(), kRounding) << actual;
}
void expect_same_rotation(const json& actual, const Quaterniond& expected) {
  const Vector3d v(0.3, -0.5, 0.8);
  EXPECT_LT((to_quaternion(actual) * v - expected * v).norm(), kRounding) << actual;
}
/// From the frame (forward, left, up) to world: rotates both frames by half a turn about x.
Quaterniond turn(const Quaterniond& q_WB) {
  const Quaterniond half(0, 1, 0, 0);
  return half * q_WB * half.conjugate();
}

void expect_pose(const json& message, const Row& row, bool is_quadrotor) {
  EXPECT_EQ(message.at("frame"), "world");
  expect_near(message.at("p"), turn(is_quadrotor ? row.p_WQ : row.p_WL));
  expect_same_rotation(message.at("q"), is_quadrotor ? turn(row.q_WB) : Quaterniond::Identity());
}

void expect_odometry(const json& message, const Row& row, bool is_quadrotor) {
  expect_pose(message, row, is_quadrotor);
  EXPECT_EQ(message.at("covariance"), 0);
  expect_near(message.at("v"),
              is_quadrotor ? turn(row.q_WB.conjugate() * row.v_WQ) : turn(row.v_WL));
  expect_near(message.at("w"), is_quadrotor ? turn(row.w_WB_B) : Vector3d::Zero());
}

void expect_marker(const json& marker, const Row& row) {
  switch (marker.at("id").get<int>()) {
    case 0:  // body
      expect_pose(marker, row, true);
      break;
    case 1:  // rod
      expect_near(marker.at("first"), turn(row.p_WQ));
      expect_near(marker.at("last"), turn(row.p_WL));
      break;
    case 2:  // load
      expect_pose(marker, row, false);
      break;
    case 3:  // trail of the load
      expect_near(marker.at("last"), turn(row.p_WL));
      break;
    default:
      break;
  }
}

TEST_F(RosReadersTest, EveryTopicOfAFlightOfTwoHasTheNumbersThatWereRecorded) {
  const std::string file = make_scenario(
      folder,
      {{"name: multirotor_figure_eight", "name: pair\nvehicles: 2"}, {"for_s: 32", "for_s: 6"}},
      "multirotor_figure_eight");
  start_watching({"0", "1"});
  start_flight(file, {"--mode", "realtime"});
  expect_flight_to_end_well();
  stop_watching();
  const auto rows = read_rows(recording_);
  ASSERT_FALSE(rows.empty());

  const auto find_row = [&](int vehicle_id, const json& message) {
    const double step = message.at("time_ns").get<double>() / kPeriodNs;
    return rows.at({vehicle_id, static_cast<std::int64_t>(step)});
  };
  for (const int id : {0, 1}) {
    const std::string name = "vehicle_" + std::to_string(id), prefix = "rt/sls/" + name + "/";
    for (const bool is_quadrotor : {false, true}) {
      const std::string part = is_quadrotor ? "quadrotor" : "load";
      const auto odometry = find_lines("topic", prefix + part + "/odometry");
      const auto poses = find_lines("topic", prefix + part + "/pose");
      EXPECT_GT(odometry.size(), 20U) << outputs();
      EXPECT_GT(poses.size(), 20U);
      for (const json& message : odometry) {
        EXPECT_EQ(message.at("child"), name + "/" + part);
        expect_odometry(message, find_row(id, message), is_quadrotor);
      }
      for (const json& message : poses) expect_pose(message, find_row(id, message), is_quadrotor);
    }
    const auto markers = find_lines("topic", prefix + "markers");
    EXPECT_GT(markers.size(), 20U);
    for (const json& marker : markers) {
      EXPECT_EQ(marker.at("ns"), name);
      expect_marker(marker, find_row(id, marker));
    }
  }
  std::map<std::string, int> children;
  for (const json& message : find_lines("topic", "rt/tf")) {
    const std::string child = message.at("child");
    ++children[child];
    const int id = child.find("vehicle_1") == 0 ? 1 : 0;
    expect_pose(message, find_row(id, message), child.find("/quadrotor") != child.npos);
  }
  for (const char* child :
       {"vehicle_0/quadrotor", "vehicle_0/load", "vehicle_1/quadrotor", "vehicle_1/load"})
    EXPECT_GT(children[child], 20) << child;
  EXPECT_EQ(children.size(), 4U);
  const auto fixed = find_lines("topic", "rt/tf_static");
  ASSERT_EQ(fixed.size(), 1U);
  EXPECT_EQ(fixed[0].at("child"), "world_z_down");
  expect_near(fixed[0].at("p"), Vector3d::Zero());
  expect_same_rotation(fixed[0].at("q"), Quaterniond(0, 1, 0, 0));
}

TEST_F(RosReadersTest, ABatchOfAnotherParticipantIsNotPublished) {
  start_watching({"0"});
  FakeServer server(domain.number(), 7);
  server.publish(RunPhase::PHASE_RUNNING);
  bus::Node other(kQosFile, domain.number(), "forger");
  bus::Writer<RecordBatch> forger(other);
  ASSERT_TRUE(wait_until([&] { return !forger.matched().empty(); })) << "read by the viewer";
  constexpr std::uint64_t kForged = 900'000;
  const auto find_poses = [this] { return find_lines("topic", "rt/sls/vehicle_0/load/pose"); };
  std::uint64_t step = 0;
  ASSERT_TRUE(wait_until([&] {
    forger.write(make_batch(7, kForged + step, kForged + step));
    server.write(make_batch(7, step, step));
    ++step;
    return find_poses().size() >= 20;
  })) << outputs();
  for (const json& message : find_poses())
    EXPECT_LT(message.at("time_ns").get<double>(), kForged * kPeriodNs);
  stop_watching();
}

TEST_F(RosReadersTest, ReferencesAreThoseOfTheController) {
  const std::string file = make_scenario(folder, {{"for_s: 2", "for_s: 5"}});
  start_watching({"0"});
  start_flight(file, {"--mode", "realtime"});
  expect_flight_to_end_well();
  stop_watching();
  const Table table(std::filesystem::path(recording_) / "reference.csv");
  std::map<std::int64_t, Vector3d> references;
  for (std::size_t i = 0; i < table.rows(); ++i)
    references[static_cast<std::int64_t>(table.number(i, "step"))] = table.position(i, "ref");
  const auto found = find_lines("topic", "rt/sls/vehicle_0/load/reference");
  EXPECT_GT(found.size(), 20U) << outputs();
  for (const json& message : found) {
    const double step = message.at("time_ns").get<double>() / kPeriodNs;
    expect_near(message.at("p"), turn(references.at(static_cast<std::int64_t>(step))));
  }
}

TEST_F(RosReadersTest, EndpointsAreAnnouncedAsThoseOfRos2AndNoneReadsRos) {
  start_watching({"0"});
  start_flight(scenario("short"), {});
  expect_flight_to_end_well();
  const auto expected = list_expected_types({0});
  ASSERT_TRUE(wait_for("{\"publication\":\"rt/sls/vehicle_0/markers\"")) << outputs();
  std::ifstream maps("/proc/" + std::to_string(view_->id()) + "/maps");
  const std::string mapped((std::istreambuf_iterator<char>(maps)), {});
  EXPECT_FALSE(mapped.empty());
  EXPECT_EQ(mapped.find(bus::kSharedMemoryPrefix), std::string::npos) << "expected UDP alone";
  stop_watching();
  std::map<std::string, std::string> types;
  for (const json& writer : find_lines("publication")) {
    const std::string topic = writer.at("publication"), type = writer.at("type");
    if (topic.rfind("rt/", 0) != 0) continue;
    types[topic] = type;
    EXPECT_EQ(writer.at("user_data"), "typehash=" + kTypeHashes.at(type) + ";") << topic;
    EXPECT_TRUE(writer.at("is_reliable").get<bool>()) << topic;
    EXPECT_TRUE(writer.at("is_transient_local").get<bool>()) << topic;
  }
  EXPECT_EQ(types, expected);
  for (const json& reader : find_lines("subscription"))
    EXPECT_EQ(reader.at("subscription").get<std::string>().rfind("sls/", 0), 0U) << reader;
}

TEST_F(RosReadersTest, AFastFlightIsThinnedToAHundredMessagesASecond) {
  const std::string file = make_scenario(folder, {{"for_s: 2", "for_s: 60"}});
  start_watching({"0"});
  const auto begin = std::chrono::steady_clock::now();
  start_flight(file, {});
  expect_flight_to_end_well();
  stop_watching();
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
  const auto poses = find_lines("topic", "rt/sls/vehicle_0/load/pose");
  EXPECT_GT(poses.size(), 5U) << outputs();
  EXPECT_LE(static_cast<double>(poses.size()), 100 * passed.count() + 1);
  const auto is_earlier = [](const json& a, const json& b) {
    return a.at("time_ns") < b.at("time_ns");
  };
  EXPECT_TRUE(std::is_sorted(poses.begin(), poses.end(), is_earlier));
}

TEST_F(RosReadersTest, AResetStartsClockAndTrailsAnew) {
  start_watching({"0"});
  start_flight(scenario("figure_eight"), {"--mode", "realtime"});
  const auto find_times = [&] {
    std::vector<std::int64_t> times;
    for (const json& message : find_lines("topic", "rt/clock"))
      times.push_back(message.at("time_ns"));
    return times;
  };
  const auto count_trail_points = [&] {
    const auto markers = find_lines("topic", "rt/sls/vehicle_0/markers");
    const auto last = std::find_if(markers.rbegin(), markers.rend(),
                                   [](const json& marker) { return marker.at("id") == 3; });
    return last == markers.rend() ? 0 : last->at("points").get<int>();
  };
  ASSERT_TRUE(wait_until([&] { return count_trail_points() > 20; })) << outputs();
  const int before = count_trail_points();
  auto control = start("sim_ctl", {"reset"});
  EXPECT_EQ(control->wait(), 0) << control->output() << outputs();
  ASSERT_TRUE(wait_until([&] {
    const auto times = find_times();
    return !std::is_sorted(times.begin(), times.end());
  })) << outputs();
  ASSERT_TRUE(wait_until([&] { return count_trail_points() < before; })) << outputs();
  control = start("sim_ctl", {"stop"});
  EXPECT_EQ(control->wait(), 0) << control->output();
  stop_watching();
}

}  // namespace
}  // namespace sls::test
