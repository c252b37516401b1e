/// This program links gone_segments.cpp, which replaces `shm_open`.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <string>

#include "fastdds_files.hpp"

namespace sls::bus {
namespace {

/// Name of a segment of this process, as Fast DDS makes them.
std::string make_name(unsigned number) {
  std::array<char, 20> digits{};
  std::snprintf(digits.data(), digits.size(), "%08x%08x", static_cast<unsigned>(::getpid()),
                number);
  return std::string("/") + kSharedMemoryPrefix + digits.data();
}

std::string read_all(int descriptor) {
  std::array<char, 100> bytes{};
  const ssize_t count = ::pread(descriptor, bytes.data(), bytes.size(), 0);
  return {bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0))};
}

class GoneSegmentsTest : public testing::Test {
 protected:
  void TearDown() override { ::shm_unlink(own_.c_str()); }

  void make_own() const {
    const int made = ::shm_open(own_.c_str(), O_CREAT | O_EXCL | O_RDWR, 0600);
    ASSERT_GE(made, 0);
    ASSERT_EQ(::write(made, "own", 3), 3);
    ::close(made);
  }

  const std::string own_ = make_name(1);
};

TEST_F(GoneSegmentsTest, OneOfAProcessThatHasLeftOpensAsACopyOfOurOwn) {
  make_own();
  const int gone = ::shm_open(make_name(2).c_str(), O_RDWR, 0600);
  ASSERT_GE(gone, 0);
  EXPECT_EQ(read_all(gone), "own");
  ASSERT_EQ(::pwrite(gone, "new", 3, 0), 3);  // the middleware counts uses there
  ::close(gone);
  const int own = ::shm_open(own_.c_str(), O_RDWR, 0600);
  EXPECT_EQ(read_all(own), "own");
  ::close(own);
}

TEST_F(GoneSegmentsTest, OtherFilesAreMissingAsEver) {
  make_own();
  const std::string begin = std::string("/") + kSharedMemoryPrefix;
  for (const std::string& name :
       {begin + "port1", begin + "0123456789abcdeg", std::string("/else")}) {
    EXPECT_EQ(::shm_open(name.c_str(), O_RDWR, 0600), -1) << name;
    EXPECT_EQ(errno, ENOENT) << name;
  }
}

TEST_F(GoneSegmentsTest, WithoutASegmentOfOurOwnItIsMissing) {
  make_own();
  ::shm_unlink(own_.c_str());
  EXPECT_EQ(::shm_open(make_name(2).c_str(), O_RDWR, 0600), -1);
  EXPECT_EQ(errno, ENOENT);
}

}  // namespace
}  // namespace sls::bus
