#include "common/bus/problems.hpp"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <sstream>

#include "tests/support/waiting.hpp"

namespace sls::bus {
namespace {

using namespace std::chrono_literals;

/// Keeps the log lines of one test.
class ProblemsTest : public testing::Test {
 protected:
  void SetUp() override {
    auto logger = std::make_shared<spdlog::logger>(
        "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log_));
    logger->set_pattern("%v");
    spdlog::set_default_logger(logger);
  }
  void TearDown() override { spdlog::set_default_logger(before_); }

  const std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
  std::ostringstream log_;
  Problems problems_;
};

TEST_F(ProblemsTest, AProblemIsLoggedOnceAndListedWhileItHolds) {
  EXPECT_EQ(problems_.describe(), "");
  const auto version = problems_.version();
  problems_.begin("a", "a is wrong");
  problems_.begin("a", "a is wrong, really");
  EXPECT_EQ(log_.str(), "a is wrong\n");
  EXPECT_EQ(problems_.describe(), "a is wrong");
  EXPECT_EQ(problems_.version(), version + 1);
  problems_.end("a");
  EXPECT_EQ(problems_.describe(), "");
  EXPECT_EQ(problems_.version(), version + 2);
}

TEST_F(ProblemsTest, ARecurringProblemIsLoggedAgain) {
  for (int i = 0; i < 2; ++i) {
    problems_.begin("a", "a is wrong");
    problems_.end("a");
  }
  EXPECT_EQ(log_.str(), "a is wrong\na is wrong\n");
}

TEST_F(ProblemsTest, ThoseThatArePutInForceReplaceTheOthersOfTheirKind) {
  problems_.begin("dds 1", "endpoint");
  problems_.replace("run ", {{"run 1", "one"}, {"run 2", "two"}});
  problems_.replace("run ", {{"run 2", "two"}, {"run 3", "three"}});
  EXPECT_EQ(problems_.describe(), "endpoint; two; three");
  EXPECT_EQ(log_.str(), "endpoint\none\ntwo\nthree\n");
  problems_.end_all("run ");
  EXPECT_EQ(problems_.describe(), "endpoint");
}

TEST_F(ProblemsTest, AProblemWithATimeLimitExpiresAndIsLoggedAgainWhenItRecurs) {
  problems_.begin("a", "a is wrong", 10ms);
  EXPECT_TRUE(test::wait_until([&] { return problems_.describe().empty(); }));
  EXPECT_FALSE(problems_.has_any("a"));
  const auto version = problems_.version();
  problems_.begin("a", "a is wrong again", 1h);
  EXPECT_EQ(problems_.describe(), "a is wrong again");
  EXPECT_TRUE(problems_.has_any("a"));
  EXPECT_EQ(problems_.version(), version + 1);
  EXPECT_EQ(log_.str(), "a is wrong\na is wrong again\n");
}

TEST_F(ProblemsTest, ThoseThatHaveExpiredTakeNoRoom) {
  for (std::size_t i = 0; i < Problems::kMost; ++i) problems_.begin(std::to_string(i), "old", 10ms);
  EXPECT_TRUE(test::wait_until([&] { return problems_.describe().empty(); }));
  problems_.begin("new", "new");
  EXPECT_EQ(problems_.describe(), "new");
}

TEST_F(ProblemsTest, AnAuthorThatIsNamedLaterIsNamedInTheListAndInTheLog) {
  problems_.begin("dds 1 fit", "topic of somebody: wrong");
  problems_.begin("dds 2 fit", "topic of somebody: wrong, too");
  const auto version = problems_.version();
  problems_.rename(" 1 ", "somebody", "'foo'");
  EXPECT_EQ(problems_.describe(), "topic of 'foo': wrong; topic of somebody: wrong, too");
  EXPECT_NE(problems_.version(), version);
  problems_.rename(" 1 ", "somebody", "'bar'");
  EXPECT_EQ(log_.str(),
            "topic of somebody: wrong\ntopic of somebody: wrong, too\ntopic of 'foo': wrong\n");
}

TEST_F(ProblemsTest, MoreThanFitAreCounted) {
  for (int i = 0; i < 9; ++i)
    problems_.begin("key " + std::to_string(i), std::to_string(i) + std::string(99, '.'));
  const std::string text = problems_.describe(255);
  EXPECT_EQ(text, "0" + std::string(99, '.') + "; 1" + std::string(99, '.') + " (+7)");
  EXPECT_LE(problems_.describe(50).size(), 50u);
}

TEST_F(ProblemsTest, AFloodOfParticipantsFillsNeitherLogNorMemory) {
  for (int i = 0; i < 100'000; ++i) problems_.begin(std::to_string(i), "wrong");
  const std::string log = log_.str();
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), Problems::kMostLines);
  EXPECT_NE(problems_.describe().find("(+"), std::string::npos);
}

}  // namespace
}  // namespace sls::bus
