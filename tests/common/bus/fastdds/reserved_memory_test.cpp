// Tests common/bus/fastdds/reserved_memory.cpp, which this program links.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>

namespace sls::bus {
namespace {

TEST(ReservedMemoryTest, AFileHasItsMemoryAtOnceOrIsRemoved) {
  const std::string name = "/sls_reserved_" + std::to_string(::getpid());
  const int file = ::shm_open(name.c_str(), O_CREAT | O_EXCL | O_RDWR, 0600);
  struct stat status {};
  for (const int bytes : {1 << 20, 4096}) {
    ASSERT_EQ(::ftruncate(file, bytes), 0);
    ASSERT_EQ(::fstat(file, &status), 0);
    EXPECT_EQ(status.st_size, bytes);
    EXPECT_GE(status.st_blocks * 512, bytes);
  }
  EXPECT_EXIT(::ftruncate(file, off_t{1} << 60), testing::ExitedWithCode(1),
              ": error: /dev/shm is full: mount -o remount");
  EXPECT_EQ(::shm_open(name.c_str(), O_RDWR, 0600), -1);
  ::close(file);
}

}  // namespace
}  // namespace sls::bus
