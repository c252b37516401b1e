#include "common/bus/end_process.hpp"

#include <gtest/gtest.h>

namespace sls::bus {
namespace {

TEST(EndProcessTest, ExitsWithTheCodeAndWithoutStaticDestructors) {
  const auto end = [] {
    std::atexit([] { std::fputs("destructors ran", stderr); });
    end_process(3);
  };
  EXPECT_EXIT(end(), testing::ExitedWithCode(3), "^$");
}

TEST(EndProcessTest, WritesWhatStreamsHold) {
  const auto end = [] {
    static char buffer[100];
    std::setvbuf(stderr, buffer, _IOFBF, sizeof buffer);
    std::fputs("held", stderr);
    end_process(0);
  };
  EXPECT_EXIT(end(), testing::ExitedWithCode(0), "^held$");
}

}  // namespace
}  // namespace sls::bus
