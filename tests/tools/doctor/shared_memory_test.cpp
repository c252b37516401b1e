#include "tools/doctor/shared_memory.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include "fastdds_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::doctor {
namespace {

using test::TemporaryFolder;

TEST(SharedMemoryTest, AFolderThatIsMissingIsNotThere) {
  const TemporaryFolder folder;
  EXPECT_FALSE(survey_shared_memory(folder / "none").is_there);
}

TEST(SharedMemoryTest, StaleSegmentsAreCountedAndStay) {
  const TemporaryFolder folder;
  const auto lock = folder / (bus::kSharedMemoryPrefix + std::string("0123456789abcdef_el"));
  test::write_bytes(folder / (bus::kSharedMemoryPrefix + std::string("0123456789abcdef")),
                    std::string(100'000, 'x'));
  test::write_bytes(lock, "");
  EXPECT_EQ(survey_shared_memory(folder.path()).stale_segments, 0) << "it may be starting";
  std::filesystem::last_write_time(
      lock, std::filesystem::file_time_type::clock::now() - std::chrono::minutes(1));
  const SharedMemory found = survey_shared_memory(folder.path());
  EXPECT_TRUE(found.is_there);
  EXPECT_EQ(found.stale_segments, 1);
  EXPECT_GE(found.stale_size, 100'000u);
  EXPECT_EQ(found.stale_owners.size(), 1u);
  EXPECT_TRUE(std::filesystem::exists(lock));
}

TEST(SharedMemoryTest, OnlyPortsWithAHolderAreRead) {
  const TemporaryFolder folder;
  for (const char* port : {"port7411", "port7413"}) {
    const std::string name = bus::kSharedMemoryPrefix + std::string(port);
    test::write_bytes(folder / name, "");
    test::write_bytes(folder / (name + "_el"), "");
  }
  const int held =
      ::open((folder / (bus::kSharedMemoryPrefix + std::string("port7413_el"))).c_str(),
             O_RDONLY | O_CLOEXEC);
  ASSERT_EQ(::flock(held, LOCK_EX), 0);
  EXPECT_EQ(survey_shared_memory(folder.path()).read_ports, std::vector<std::uint32_t>{7413});
  ::close(held);
}

}  // namespace
}  // namespace sls::doctor
