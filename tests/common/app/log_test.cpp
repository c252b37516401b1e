#include "common/app/log.hpp"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <functional>

namespace sls::app {
namespace {

struct Output {
  std::string out, err;
};

Output capture(const std::function<void()>& work) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  work();
  Output output;
  output.out = testing::internal::GetCapturedStdout();
  output.err = testing::internal::GetCapturedStderr();
  return output;
}

void log_one_of_each() {
  spdlog::debug("a detail");
  spdlog::info("waiting for: {} ({} s left)", "recorder", 18);
  spdlog::warn("slow");
  spdlog::error("broken");
}

TEST(LogTest, WritesOneLinePerEventOnStderrAndNothingOnStdout) {
  start_log("sim_server", "info");
  const Output output = capture(log_one_of_each);
  EXPECT_EQ(output.err,
            "sim_server: waiting for: recorder (18 s left)\n"
            "sim_server: warning: slow\n"
            "sim_server: error: broken\n");
  EXPECT_EQ(output.out, "");
}

TEST(LogTest, ShowsFromTheLevelOn) {
  const auto log_at = [](const char* level) {
    start_log("x", level);
    return capture(log_one_of_each).err;
  };
  EXPECT_EQ(
      log_at("debug"),
      "x: a detail\nx: waiting for: recorder (18 s left)\nx: warning: slow\nx: error: broken\n");
  EXPECT_EQ(log_at("warning"), "x: warning: slow\nx: error: broken\n");
  EXPECT_EQ(log_at("error"), "x: error: broken\n");
}

TEST(LogTest, BracesInATextAreNotAFormat) {
  start_log("x", "info");
  EXPECT_EQ(capture([] { spdlog::error("{}", "got {} and {1}"); }).err,
            "x: error: got {} and {1}\n");
}

TEST(LogTest, TextsOfOthersCannotControlTheTerminal) {
  start_log("x", "info");
  const auto log = [](const std::string& text) { return capture([&] { spdlog::info(text); }).err; };
  EXPECT_EQ(log("a\x1b[2J\r\n\t\x7f"), "x: a\\x1b[2J\\x0d\\x0a\\x09\\x7f\n");
  EXPECT_EQ(log("C1 \xc2\x80 \xc2\x9b \x9b"), "x: C1 \\xc2\\x80 \\xc2\\x9b \\x9b\n");
  EXPECT_EQ(log("\u202E\u2066 \xe2\x80"), "x: \\xe2\\x80\\xae\\xe2\\x81\\xa6 \\xe2\\x80\n");
  EXPECT_EQ(log("π µs, \u00a0 … 機 🚁"), "x: π µs, \u00a0 … 機 🚁\n");
  EXPECT_EQ(capture([] { print("a\x1b\nb"); }).out, "a\\x1b\\x0ab\n");
}

TEST(LogTest, ALaterStartReplacesTheEarlier) {
  start_log("first", "debug");
  start_log("second", "info");
  EXPECT_EQ(capture([] { spdlog::info("once"); }).err, "second: once\n");
}

}  // namespace
}  // namespace sls::app
