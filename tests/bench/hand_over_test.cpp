#include "bench/hand_over.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cerrno>
#include <nlohmann/json.hpp>

namespace sls::bench {
namespace {

class HandOverTest : public testing::TestWithParam<bool> {
 protected:
  HandOverOptions options_ = [] {
    HandOverOptions options;
    options.rounds = 200;
    options.warm_up = 10;
    options.may_spin = GetParam();
    return options;
  }();
};

TEST_P(HandOverTest, ARoundHasTheWorkInIt) {
  options_.work_us = 500.0;
  EXPECT_GE(HandOver(options_).measure().at("mean_us"), 500.0);
}

TEST_P(HandOverTest, LeavesNoProcessBehind) {
  HandOver(options_).measure();
  EXPECT_EQ(waitpid(-1, nullptr, 0), -1);
  EXPECT_EQ(errno, ECHILD);
}

INSTANTIATE_TEST_SUITE_P(BlockingAndSpinning, HandOverTest, testing::Bool());

}  // namespace
}  // namespace sls::bench
