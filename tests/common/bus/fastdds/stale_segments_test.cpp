#include "common/bus/fastdds/stale_segments.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include "common/bus/fastdds/guarded_transports.hpp"
#include "fastdds_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::bus {
namespace {

namespace fs = std::filesystem;

/// Name of a file of the middleware.
std::string make_name(const std::string& rest) { return kSharedMemoryPrefix + rest; }

/// Name of the file of a port.
std::string make_port(std::uint32_t port) {
  return make_name("port") + std::to_string(make_memory_port(port));
}

class StaleSegmentsTest : public ::testing::Test {
 protected:
  void make(const std::string& name, std::chrono::seconds age) const {
    test::write_bytes(folder_ / name, std::string("\2\0\0\0", 4));  // finished
    fs::last_write_time(folder_ / name, fs::file_time_type::clock::now() - age);
  }
  bool exists(const std::string& name) const { return fs::exists(folder_ / name); }

  test::TemporaryFolder folder_;
};

TEST_F(StaleSegmentsTest, ASegmentWithoutALockHolderIsRemoved) {
  make(make_name("0123456789abcdef"), std::chrono::seconds(60));
  make(make_name("0123456789abcdef_el"), std::chrono::seconds(60));
  remove_stale_segments(folder_.path());
  EXPECT_FALSE(exists(make_name("0123456789abcdef")));
  EXPECT_FALSE(exists(make_name("0123456789abcdef_el")));
}

TEST_F(StaleSegmentsTest, ASegmentInUseStays) {
  make(make_name("0123456789abcdef"), std::chrono::seconds(60));
  make(make_name("0123456789abcdef_el"), std::chrono::seconds(60));
  const fs::path lock = folder_ / make_name("0123456789abcdef_el");
  const int descriptor = open(lock.c_str(), O_RDONLY);
  ASSERT_EQ(flock(descriptor, LOCK_EX | LOCK_NB), 0);
  remove_stale_segments(folder_.path());
  EXPECT_TRUE(exists(make_name("0123456789abcdef")));
  EXPECT_TRUE(exists(make_name("0123456789abcdef_el")));
  close(descriptor);
}

TEST_F(StaleSegmentsTest, ASegmentThatIsJustBeingMadeStays) {
  make(make_name("0123456789abcdef_el"), std::chrono::seconds(0));
  remove_stale_segments(folder_.path());
  EXPECT_TRUE(exists(make_name("0123456789abcdef_el")));
}

TEST_F(StaleSegmentsTest, SharedDataOfAKilledProcessIsRemovedIfItIsOurs) {
  const std::string ours = std::string(kDataSharingPrefix) + "1", used = ours + "1",
                    others = ours + "2";
  for (const std::string& name : {ours, used, others}) make(name, std::chrono::seconds(60));
  for (const std::string& name : {ours, used})
    ASSERT_EQ(chmod((folder_ / name).c_str(), 0600 | kOwnMark), 0);
  const int descriptor = open((folder_ / used).c_str(), O_RDONLY);
  ASSERT_EQ(flock(descriptor, LOCK_SH), 0);
  EXPECT_EQ(find_stale_segments(folder_.path()), std::vector<fs::path>{folder_ / ours});
  remove_stale_segments(folder_.path());
  EXPECT_FALSE(exists(ours));
  EXPECT_TRUE(exists(used));
  EXPECT_TRUE(exists(others));
  close(descriptor);
}

TEST_F(StaleSegmentsTest, WhatAKilledProcessHadNotFinishedIsRemoved) {
  const std::string names[] = {make_port(8160), make_name("port8161"),
                               std::string(kDataSharingPrefix) + "1"};
  for (const std::size_t size : {0, 100}) {
    for (const std::string& name : names)
      test::write_bytes(folder_ / name, std::string(size, '\0'));
    EXPECT_TRUE(find_stale_segments(folder_.path()).empty()) << "they may be made just now";
    for (const std::string& name : names)
      fs::last_write_time(folder_ / name,
                          fs::file_time_type::clock::now() - std::chrono::seconds(60));
    remove_stale_segments(folder_.path());
    for (const std::string& name : names) EXPECT_FALSE(exists(name)) << name;
  }
  make(make_name("0123456789abcdef"), std::chrono::seconds(60));
  remove_stale_segments(folder_.path());
  EXPECT_FALSE(exists(make_name("0123456789abcdef"))) << "it has lost its lock file";
}

TEST_F(StaleSegmentsTest, EverythingElseStays) {
  const std::string names[] = {make_port(8160) + "_el",
                               make_port(8160),
                               "other_0123456789abcdef_el",
                               make_name("0123456789abcdeg_el"),
                               make_name("0123456789abcdef0_el"),
                               make_name("_el"),
                               "sem." + make_name("port8160_mutex")};
  for (const std::string& name : names) make(name, std::chrono::seconds(60));
  remove_stale_segments(folder_.path());
  for (const std::string& name : names) EXPECT_TRUE(exists(name)) << name;
  remove_stale_segments(folder_ / "no such folder");
}

TEST_F(StaleSegmentsTest, WithoutStalePortsAnyParticipantIdWillDo) {
  EXPECT_EQ(choose_participant_id({8160, 2}, {}, folder_.path()), -1);
  make(make_port(8160), std::chrono::seconds(60));  // of a process that ended normally
  EXPECT_EQ(choose_participant_id({8160, 2}, {}, folder_.path()), -1);
  EXPECT_EQ(choose_participant_id({8160, 2}, {}, folder_ / "no such folder"), -1);
}

TEST_F(StaleSegmentsTest, PortsOfKilledAndOfLivingProcessesAreAvoided) {
  make(make_port(8161) + "_el", std::chrono::seconds(60));  // participant 0: killed
  make(make_port(8162) + "_el", std::chrono::seconds(60));  // participant 1: alive
  const fs::path lock = folder_ / (make_port(8162) + "_el");
  const int descriptor = open(lock.c_str(), O_RDONLY);
  ASSERT_EQ(flock(descriptor, LOCK_EX | LOCK_NB), 0);
  EXPECT_EQ(choose_participant_id({8160, 2}, {}, folder_.path()), 2);
  EXPECT_EQ(choose_participant_id({8160, 2}, {2, 3}, folder_.path()), 4) << "ids of this process";
  test::write_bytes(folder_ / make_port(8164), "");  // participant 2: killed as it made the port
  EXPECT_EQ(choose_participant_id({8160, 2}, {}, folder_.path()), 3);
  close(descriptor);
  // The ports of another domain do not matter.
  EXPECT_EQ(choose_participant_id({8410, 2}, {}, folder_.path()), -1);
}

}  // namespace
}  // namespace sls::bus
