#include "common/bus/environment.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>

#include "tests/support/temporary_folder.hpp"

namespace sls::bus {
namespace {

Environment make_usual() {
  Environment seen;
  seen.user = "bob";
  seen.uses_shared_memory = true;
  seen.addresses = seen.addresses_at_start = {"127.0.0.1", "10.0.0.1"};
  seen.programs = {{"sim_server", "bob", 4711, 0, "hover"}, {"control_client", "bob", 12, 5, ""}};
  seen.free_domain = 1;
  return seen;
}

TEST(EnvironmentTest, TheFirstKnownCauseIsNamedWithItsCure) {
  struct Row {
    std::function<void(Environment&)> change;
    std::string cause;  // begins so; empty: none
    bool is_start_error = false;
  };
  // Each row keeps the changes of those before it, so it also shows the order.
  const std::vector<Row> rows = {
      {[](auto&) {}, ""},
      {[](auto& it) { it.programs[0].user = "alice"; },
       "a flight of 'hover' (alice, sim_server, process 4711) is on domain 0; use --domain 1",
       true},
      {[](auto& it) { it.participants = 64; }, "domain 0 has 64 participants"},
      {[](auto& it) { it.addresses_at_start = {"127.0.0.1"}; },
       "the addresses of this machine were '127.0.0.1' when this program started"},
      {[](auto& it) { it.addresses = {"127.0.0.1"}; }, "no interface that is up has an IPv4"},
      {[](auto& it) { it.addresses = {"10.0.0.1"}; }, "no interface that is up has 127.0.0.1"},
      {[](auto& it) { it.free_descriptors = 1; },
       "expected 2 free file descriptors at least, got 1 (EMFILE)"},
      {[](auto& it) { it.shared_memory_defect = "Read-only file system"; },
       "/dev/shm: expected a folder that this user can write to, got 'Read-only file system'",
       true},
      {[](auto& it) { it.is_ros_server_ignored = true; }, "ROS_DISCOVERY_SERVER is ignored"},
  };
  Environment seen = make_usual();
  for (const Row& row : rows) {
    row.change(seen);
    const std::string cause = find_cause(seen);
    EXPECT_EQ(cause.substr(0, row.cause.size()), row.cause);
    EXPECT_EQ(cause.empty(), row.cause.empty()) << cause;
    if (row.is_start_error) EXPECT_EQ(find_cause(seen, true), cause);
  }
  seen = make_usual();
  seen.free_descriptors = 15;
  EXPECT_NE(find_cause(seen, true).find("expected 16 free file descriptors"), std::string::npos);
}

TEST(EnvironmentTest, WhatDoesNotConcernAProgramIsNoCause) {
  Environment seen = make_usual();
  seen.is_local = seen.is_ros_server_ignored = true;
  seen.addresses_at_start = {"127.0.0.1"};
  seen.uses_shared_memory = false;
  seen.shared_memory_defect = "none";
  seen.programs[0].user = "alice";
  EXPECT_EQ(find_cause(seen) + find_cause(seen, true), "");
  seen.addresses_at_start = {};
  EXPECT_NE(find_cause(seen), "") << "it started before its interface was up";
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
  std::string table = "  sl  local_address rem_address st tx_queue tr tm->when retrnsmt uid\n";
  for (const char* port : {"21CC", "0035"})  // 0x21CC is 7400 + 5 × 250 + 2
    table += " 1: 0100007F:" + std::string(port) + " 00000000:0000 07 0:0 00:0 0 " +
             std::to_string(::getuid()) + " 0 1\n";
  test::write_bytes(folder / "udp", table);
  Environment seen;
  const DomainUsers users = find_domain_users(seen, folder / "udp");
  EXPECT_EQ(users, (DomainUsers{{5, {::getuid()}}}));
  seen.programs = find_programs(users, folder.path());
  ASSERT_EQ(seen.programs.size(), 2u);
  EXPECT_EQ(seen.programs[1].process, 11);
  seen.user = seen.programs[0].user;
  const std::string flight =
      "a flight of 'hover' (" + seen.user + ", sim_server, process 12) is on domain 5";
  EXPECT_EQ(describe_other_flight(seen), "");
  EXPECT_EQ(describe_other_flight(seen, true), flight);
  seen.domain = 5;
  seen.free_domain = 6;
  EXPECT_EQ(describe_other_flight(seen), flight + "; use --domain 6");
}

TEST(EnvironmentTest, AFolderThatIsMissingOrNoneHasADefect) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(find_shared_memory_defect(folder.path()), "");
  EXPECT_EQ(find_shared_memory_defect(folder / "none"), "No such file or directory");
  test::write_bytes(folder / "file", "");
  EXPECT_EQ(find_shared_memory_defect(folder / "file"), "Not a directory");
}

}  // namespace
}  // namespace sls::bus
