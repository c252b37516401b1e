#include "common/bus/environment.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <functional>

#include "tests/support/temporary_folder.hpp"

namespace sls::bus {
namespace {

Environment make_usual() {
  Environment seen;
  seen.uses_shared_memory = true;
  seen.addresses = seen.addresses_at_start = {"127.0.0.1", "10.0.0.1"};
  seen.user = "bob";
  seen.free_domain = 1;
  return seen;
}

const FlightProgram kServerOfAlice{"sim_server", "alice", 4711, 0, "hover"};
const FlightProgram kClientElsewhere{"control_client", "bob", 12, 5, ""};

TEST(EnvironmentTest, TheFirstKnownCauseIsNamedWithItsCure) {
  struct Row {
    std::function<void(Environment&)> change;
    std::string words;  // that the cause has; empty: no cause
  };
  // Each row keeps the changes of those before it, so it also shows the order.
  Environment seen = make_usual();
  const std::vector<Row> rows = {
      {[](auto&) {}, ""},
      {[](auto& it) {
         it.programs = {kClientElsewhere, kServerOfAlice};
       },
       ""},
      {[](auto& it) { it.other_users = {"carol"}; },
       "programs of user carol are on domain 0; use --domain 1"},
      {[](auto& it) { it.other_users = {"alice"}; },
       "a flight of 'hover' (alice, sim_server, process 4711) is on domain 0; use --domain 1"},
      {[](auto& it) { it.participants = 64; }, "domain 0 has 64 participants"},
      {[](auto& it) { it.addresses_at_start = {"127.0.0.1"}; },
       "were 127.0.0.1 when this program started and are 10.0.0.1, 127.0.0.1 now: start it again"},
      {[](auto& it) { it.addresses = {"127.0.0.1"}; }, "no interface that is up has an IPv4"},
      {[](auto& it) { it.addresses = {"10.0.0.1"}; }, "ip link set lo up"},
      {[](auto& it) { it.free_descriptors = 1; }, "1 of 1024 file descriptors are free (EMFILE)"},
      {[](auto& it) { it.shared_memory_defect = "Read-only file system"; },
       "/dev/shm: expected a folder that this user can write to, got 'Read-only file system'"},
      {[](auto& it) { it.is_ros_server_ignored = true; }, "ROS_DISCOVERY_SERVER is ignored"},
  };
  for (const Row& row : rows) {
    row.change(seen);
    const std::string cause = find_cause(seen);
    EXPECT_EQ(cause.empty(), row.words.empty()) << cause;
    EXPECT_NE(cause.find(row.words), cause.npos) << cause << "\n" << row.words;
  }
}

TEST(EnvironmentTest, WhatDoesNotConcernAProgramIsNoCause) {
  Environment seen = make_usual();
  seen.is_local = true;
  seen.addresses_at_start = {"127.0.0.1"};
  seen.is_ros_server_ignored = true;
  EXPECT_EQ(find_cause(seen), "");
  seen.addresses_at_start = {};
  EXPECT_NE(find_cause(seen), "") << "it started before its interface was up";
  seen = make_usual();
  seen.uses_shared_memory = false;
  seen.shared_memory_defect = "none";
  seen.other_users = {"alice"};
  seen.programs = {kServerOfAlice};
  EXPECT_EQ(find_cause(seen), "");
  EXPECT_EQ(find_start_error(seen), "");
}

TEST(EnvironmentTest, AStartFailsWithoutDescriptorsAndBesideAFlightOfAnotherUser) {
  Environment seen = make_usual();
  seen.other_users = {"alice"};
  EXPECT_EQ(find_start_error(seen), "") << "perhaps not a program of ours";
  seen.programs = {kServerOfAlice};
  EXPECT_NE(find_start_error(seen).find("is on domain 0; use --domain 1"), std::string::npos);
  seen.free_descriptors = 15;
  EXPECT_EQ(find_start_error(seen),
            "expected 16 free file descriptors at least, got: 15 of 1024 file descriptors are free "
            "(EMFILE): ulimit -n 1024");
}

TEST(EnvironmentTest, AnotherFlightIsItsServerHereOrAnyProgramElsewhere) {
  Environment seen = make_usual();
  seen.programs = {kClientElsewhere};
  EXPECT_EQ(describe_other_flight(seen), "");
  EXPECT_EQ(describe_other_flight(seen, true),
            "a flight (bob, control_client, process 12) is on domain 5");
  seen.programs = {kServerOfAlice};
  EXPECT_EQ(describe_other_flight(seen),
            "a flight of 'hover' (alice, sim_server, process 4711) is on domain 0; use --domain 1");
}

TEST(EnvironmentTest, ProgramsAreThoseWhoseUserHasAPortOpenOnTheirDomain) {
  const test::TemporaryFolder folder;
  const auto run = [&](const std::string& process, const std::string& name,
                       const std::string& words, const std::string& variables = {}) {
    std::filesystem::create_directories(folder / process);
    test::write_bytes(folder / (process + "/comm"), name + "\n");
    test::write_bytes(folder / (process + "/cmdline"), words);
    test::write_bytes(folder / (process + "/environ"), variables);
  };
  using namespace std::string_literals;
  run("11", "recorder", "recorder\0--domain\0005\0"s);
  run("12", "sim_server", "sim_server\0--scenario=/tmp/hover.yaml\0"s, "A=1\0SLS_DOMAIN=5\0"s);
  run("13", "sim_server", "sim_server\0--domain=6\0"s);
  run("14", "other", "other\0--domain\0005\0"s);
  const std::string user = std::to_string(::getuid());
  test::write_bytes(folder / "udp",
                    "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt"
                    "   uid  timeout inode\n"
                    "    1: 0100007F:21CC 00000000:0000 07 0:0 00:0 00000000 " +
                        user +
                        " 0 1\n"
                        "    2: 0100007F:0035 00000000:0000 07 0:0 00:0 00000000 " +
                        user + " 0 1\n");
  const DomainUsers users = find_domain_users({}, folder / "udp");  // 0x21CC is 7400 + 5 × 250 + 2
  EXPECT_EQ(users, (DomainUsers{{5, {::getuid()}}}));
  const auto programs = find_programs(users, folder.path());
  ASSERT_EQ(programs.size(), 2u);
  EXPECT_EQ(programs[0].process, 12);
  EXPECT_EQ(programs[0].scenario, "hover");
  EXPECT_EQ(programs[1].process, 11);
  EXPECT_EQ(programs[1].domain, 5);
}

TEST(EnvironmentTest, AFolderThatIsMissingOrClosedHasADefect) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(find_shared_memory_defect(folder.path()), "");
  EXPECT_EQ(find_shared_memory_defect(folder / "none"), "No such file or directory");
  test::write_bytes(folder / "file", "");
  EXPECT_EQ(find_shared_memory_defect(folder / "file"), "Not a directory");
}

TEST(EnvironmentTest, VariablesOfRosAreDroppedAndRemembered) {
  ::setenv("ROS_DISCOVERY_SERVER", "10.0.0.1:11811", 1);
  drop_foreign_variables();
  EXPECT_EQ(std::getenv("ROS_DISCOVERY_SERVER"), nullptr);
  EXPECT_TRUE(is_ros_server_ignored());
}

}  // namespace
}  // namespace sls::bus
