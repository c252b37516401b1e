/// Fleets with the real programs. Every vehicle flies as it would alone, for every distribution of
/// the fleet over servers, clients, threads and transports.
#include <gtest/gtest.h>
#include <signal.h>

#include <map>

#include "common/config/scenario.hpp"
#include "common/config/vehicle_ids.hpp"
#include "tests/system/fleet_flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

const std::vector<std::uint32_t> kAll = {0, 1, 2, 3, 4, 5};

using Changes = std::vector<std::pair<std::string, std::string>>;

class FleetTest : public ProgramsTest {};

TEST_F(FleetTest, OfOneProcessRecordsEachAsAlone) {
  const std::string file = scenario("mixed_fleet");
  const fs::path together = fly_in_process(file, folder / "together");
  expect_each_flies_as_alone(together, file, {0, 1, 2, 3});
  const Table joined(together / "flight.csv"), states(together / "state.csv");
  EXPECT_EQ(joined.names().back(), "vehicle_id");
  ASSERT_EQ(joined.rows(), states.rows());
  for (std::size_t row = 0; row < joined.rows(); ++row)
    ASSERT_EQ(joined.text(row, "vehicle_id"), states.text(row, "vehicle_id")) << row;
}

// --- one fleet, spread in different ways ---------------------------------------------------------

struct Spread {
  const char* name;
  std::string qos_file;
  const char* threads;
  std::vector<std::string> clients;  ///< vehicles of each client
  std::string vehicles = {};         ///< instead of the six: number of vehicles in a grid
};

/// A grid of `vehicles` equal vehicles, each with the first 0.2 s of the figure eight.
std::string make_grid_scenario(const TemporaryFolder& folder, const std::string& vehicles) {
  const std::string file = folder / "grid.yaml";
  write_bytes(file, replace_once(read_file(scenario("short")), "for_s: 2", "for_s: 0.2") +
                        "vehicles: " + vehicles + "\n");
  return file;
}

class SpreadTest : public FleetTest, public ::testing::WithParamInterface<Spread> {};

TEST_P(SpreadTest, EveryVehicleFliesAsAlone) {
  const Spread& spread = GetParam();
  const std::string file = spread.vehicles.empty() ? make_fleet_scenario(folder)
                                                   : make_grid_scenario(folder, spread.vehicles);
  std::vector<std::unique_ptr<Process>> programs;
  const auto start = [&](const char* name, const Words& flags) {
    programs.push_back(Programs::start(name, flags, {}, spread.qos_file));
  };
  start("recorder", {"--out", recording()});
  start("sim_server", {"--scenario", file, "--threads", spread.threads});
  for (const std::string& vehicles : spread.clients)
    start("control_client",
          {"--scenario", file, "--vehicles", vehicles, "--name", "of-" + vehicles.substr(0, 1)});
  for (const auto& process : programs) EXPECT_EQ(process->wait(), 0) << process->output();
  EXPECT_TRUE(read_manifest(recording()).at("complete").get<bool>());
  expect_each_flies_as_alone(
      recording(), file,
      config::parse_vehicle_ids("all", config::load_scenario(file).vehicles.size()));
}

INSTANTIATE_TEST_SUITE_P(
    FleetTest, SpreadTest,
    ::testing::Values(
        Spread{"ThreeClientsOverUdp", qos("udp"), "2", {"0,2,4", "1,5", "3"}},
        Spread{"MoreThanASampleHolds", {}, "2", {"all"}, "130"},
        Spread{"TheLargestByTwoClientsOverUdp", qos("udp"), "2", {"0-99", "100-255"}, "256"}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

TEST_F(FleetTest, SharedByTwoServersFliesAsAlone) {
  const std::string file = make_fleet_scenario(folder);
  const std::vector<std::vector<std::uint32_t>> halves = {{0, 1}, {2, 3, 4, 5}};
  std::vector<std::unique_ptr<Process>> programs;
  for (const std::string vehicles : {"0-1", "2-5"}) {
    const std::string first = vehicles.substr(0, 1);
    programs.push_back(start("recorder", {"--out", folder / first, "--vehicle", first}));
    programs.push_back(start("sim_server", {"--scenario", file, "--vehicles", vehicles}));
    programs.push_back(start(
        "control_client", {"--scenario", file, "--vehicles", vehicles, "--name", "of-" + first}));
  }
  for (const auto& process : programs) EXPECT_EQ(process->wait(), 0) << process->output();
  for (const auto& ids : halves)
    expect_each_flies_as_alone(folder / std::to_string(ids[0]), file, ids);
}

// --- failures ------------------------------------------------------------------------------------

/// A long flight, for tests that disturb or stop it.
const Changes kLong = {{"for_s: 0.4", "for_s: 60"}};

TEST_F(FleetTest, AKilledClientOfOneHalfIsReplacedByAStandbyAndNothingElseChanges) {
  const std::string file = make_fleet_scenario(
      folder, {{"controllers: 1", "controllers: 2"}, {"for_s: 0.4", "for_s: 8"}});
  Flight flight(file, {{}, {}, {"--vehicles", "0-2", "--name", "first-half", "--strength", "2"}});
  const auto start_other = [&](const Words& flags) {
    return flight.start("control_client", Words{"--scenario", file} + flags);
  };
  const auto second =
      start_other({"--vehicles", "3-5", "--name", "second-half", "--strength", "2"});
  const auto standby = start_other({"--name", "standby", "--strength", "1"});
  ASSERT_TRUE(flight.wait_for_steps(6 * 100)) << flight.outputs();
  flight.client->kill();
  EXPECT_EQ(flight.server->wait(), 0) << flight.outputs();
  EXPECT_EQ(flight.recorder->wait(), 0) << flight.outputs();
  for (Process* process : {second.get(), standby.get()})
    EXPECT_EQ(process->wait(), 0) << process->output();
  EXPECT_TRUE(
      holds(flight.server->output(), "'standby' takes over from 'first-half' (vehicles 0-2)"))
      << flight.server->output();
  expect_each_flies_as_alone(flight.recording(), file, kAll);
  const Table commands(flight.recording() / "command.csv");
  std::map<std::string, std::string> last_client;
  for (std::size_t row = 0; row < commands.rows(); ++row)
    last_client[commands.text(row, "vehicle_id")] = commands.text(row, "controller");
  for (const char* id : {"0", "1", "2"}) EXPECT_EQ(last_client[id], "standby") << id;
}

/// Vehicles on one load, each with a client of its own, and the network.
struct Group {
  const char* scenario;
  bool is_lossy;
};

class GroupTest : public FleetTest, public ::testing::WithParamInterface<Group> {};

TEST_P(GroupTest, AClientDiesAndNoByteChanges) {
  const std::string file = scenario(GetParam().scenario);
  const std::string qos_file = GetParam().is_lossy ? qos("udp") : "";
  const auto run = [&](const char* name, const Words& flags) {
    return start(name, flags, GetParam().is_lossy ? lossy(5) : Words{}, qos_file);
  };
  const auto recorder = run("recorder", {"--out", recording()});
  const auto server = run("sim_server", Words{"--scenario", file} + kManySteps);
  std::vector<std::unique_ptr<Process>> clients;
  const std::size_t count = config::load_scenario(file).vehicles.size();
  const std::string last = std::to_string(count - 1);
  for (std::size_t id = 0; id < count; ++id)
    clients.push_back(
        run("control_client", {"--scenario", file, "--vehicles", std::to_string(id), "--name",
                               "of-" + std::to_string(id), "--strength", "2"}));
  clients.push_back(run("control_client", {"--scenario", file, "--vehicles", last, "--name",
                                           "standby", "--strength", "1"}));
  // With losses the standby may be found first and begin the flight.
  const auto is_flown_by_the_last = [&] {
    const fs::path commands = recording() / "command.csv";
    return fs::exists(commands) && fs::file_size(commands) > 100'000 &&
           holds(read_file(commands), ",of-" + last);
  };
  ASSERT_TRUE(wait_until(is_flown_by_the_last)) << server->output();
  clients[count - 1]->kill();
  clients.erase(clients.end() - 2);
  EXPECT_EQ(server->wait(), 0) << server->output();
  EXPECT_EQ(recorder->wait(), 0) << recorder->output();
  for (const auto& client : clients) EXPECT_EQ(client->wait(), 0) << client->output();
  EXPECT_TRUE(holds(server->output(), "'standby' takes over from 'of-" + last + "'"))
      << server->output();
  expect_undisturbed(recording(), file, kManySteps);
}

INSTANTIATE_TEST_SUITE_P(FleetTest, GroupTest,
                         ::testing::Values(Group{"one_controller_dies", false},
                                           Group{"aggressive_slack", false},
                                           Group{"lift_and_set_down", false},
                                           Group{"two_carry_a_bar", true}),
                         [](const auto& flown) { return std::string(flown.param.scenario); });

// --- resources -----------------------------------------------------------------------------------

struct Resources {
  std::size_t descriptors = 0;
  long resident_kb = 0;
};

Resources read_resources(pid_t id) {
  const fs::path process = "/proc/" + std::to_string(id);
  Resources resources;
  for ([[maybe_unused]] const auto& descriptor : fs::directory_iterator(process / "fd"))
    ++resources.descriptors;
  const std::string status = read_file(process / "status"), key = "VmRSS:";
  resources.resident_kb = std::stol(status.substr(status.find(key) + key.size()));
  return resources;
}

TEST_F(FleetTest, NeitherMemoryNorDescriptorsGrowInFlightAndNothingIsLeftBehind) {
  // A small history of sls/record: it fills quickly and then no longer grows.
  const std::string file = make_fleet_scenario(folder, kLong);
  Flight flight(file, {make_qos_with_history(folder, "default", "100"), {}, {}});
  const auto control = [&](const Words& words) {
    expect_success({flight.start("sim_ctl", words).get()});
  };
  ASSERT_TRUE(flight.wait_for_steps(6)) << flight.outputs();
  control({"pause"});
  // After these steps every history is full.
  control({"step", "1000"});
  Process* const programs[] = {flight.server.get(), flight.client.get(), flight.recorder.get()};
  std::vector<Resources> before;
  std::vector<fs::path> segments;
  for (const Process* process : programs) {
    before.push_back(read_resources(process->id()));
    for (const auto& segment : find_shared_memory(process->id())) segments.push_back(segment);
  }
  EXPECT_FALSE(segments.empty());
  control({"step", "3000"});
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Resources after = read_resources(programs[i]->id());
    EXPECT_EQ(after.descriptors, before[i].descriptors) << i;
    // 18,000 states of 300 bytes each would take 5 MB if a program kept them.
    EXPECT_LT(after.resident_kb, before[i].resident_kb + 2500) << i;
  }
  control({"stop"});
  flight.wait();
  for (const auto& segment : segments) EXPECT_FALSE(fs::exists(segment)) << segment;
}

TEST_F(FleetTest, ARecorderKeepsNothingOfAnotherRunOnItsDomain) {
  const std::string file = make_fleet_scenario(
      folder, {{"for_s: 0.4", "for_s: 30"}, {"timeout_s: 30", "timeout_s: 300"}});
  const auto recorder = start("recorder", {"--out", recording()});
  ASSERT_TRUE(wait_for_text(*recorder, "waiting for: server")) << recorder->output();
  const long before_kb = read_resources(recorder->id()).resident_kb;
  const fs::path others = folder / "others";
  std::vector<std::unique_ptr<Process>> programs;
  programs.push_back(start("recorder", {"--out", others, "--vehicle", "1"}));
  for (const char* name : {"sim_server", "control_client"})
    programs.push_back(start(name, {"--scenario", file, "--vehicles", "1-5"}));
  ASSERT_TRUE(wait_until([&] { return read_file(others / "state.csv").size() > 1'000'000; }))
      << programs[0]->output();
  // The recorder's own run begins during the other one and waits for its client until the other
  // ends.
  const auto server = start("sim_server", {"--scenario", file, "--vehicles", "0"});
  for (const auto& process : programs) EXPECT_EQ(process->wait(), 0) << process->output();
  ASSERT_TRUE(holds(recorder->output(), "records run")) << recorder->output();
  // The other run's state, command and reference samples (five vehicles, at least 7,500 steps, at
  // least 200 bytes) would take 22 MB if kept; an earlier version took 83 MB. More participants and
  // the recorder's own run take about 4 MB.
  EXPECT_LT(read_resources(recorder->id()).resident_kb, before_kb + 11'000);
  const auto client = start("control_client", {"--scenario", file, "--vehicles", "0"});
  expect_success({server.get(), client.get(), recorder.get()});
  expect_each_flies_as_alone(recording(), file, {0});
}

}  // namespace
}  // namespace sls::test
