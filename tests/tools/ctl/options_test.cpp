#include "tools/ctl/options.hpp"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <string>

#include "tests/support/errors.hpp"

namespace sls::ctl {
namespace {

Options parse(const std::string& command_line) {
  CLI::App cli;
  Options options;
  add_options(cli, options);
  cli.parse(command_line);
  return options;
}

std::string find_error(const std::string& command_line) {
  return test::find_error<CLI::ParseError>([&] { parse(command_line); });
}

TEST(OperatorOptionsTest, EverySubcommandIsAnAction) {
  EXPECT_EQ(parse("pause").action, ControlAction::ACTION_PAUSE);
  EXPECT_EQ(parse("resume").action, ControlAction::ACTION_RESUME);
  EXPECT_EQ(parse("start").action, ControlAction::ACTION_START);
  EXPECT_EQ(parse("reset").action, ControlAction::ACTION_RESET);
  EXPECT_EQ(parse("stop").action, ControlAction::ACTION_STOP);
  const Options step = parse("step 25");
  EXPECT_EQ(step.action, ControlAction::ACTION_STEP);
  EXPECT_EQ(step.steps, 25u);
}

TEST(OperatorOptionsTest, StatusIsAskedForOnceOrWatchedAsTextOrJson) {
  const Options once = parse("status");
  EXPECT_EQ(once.action, std::nullopt);
  EXPECT_FALSE(once.watch);
  EXPECT_FALSE(once.json);
  const Options watched = parse("status --watch --json");
  EXPECT_TRUE(watched.watch);
  EXPECT_TRUE(watched.json);
}

TEST(OperatorOptionsTest, FlagsMayStandOnEitherSideOfTheSubcommand) {
  for (const char* line : {"--domain 7 --vehicle 2 --timeout-s 0.5 --qos my.xml step 3",
                           "step 3 --domain 7 --vehicle 2 --timeout-s 0.5 --qos my.xml",
                           "--domain 7 step --vehicle 2 3 --timeout-s 0.5 --qos my.xml"}) {
    SCOPED_TRACE(line);
    const Options options = parse(line);
    EXPECT_EQ(options.common.domain, 7);
    EXPECT_EQ(options.vehicle_id, 2u);
    EXPECT_EQ(options.timeout_s, 0.5);
    EXPECT_EQ(options.common.qos_file, "my.xml");
    EXPECT_EQ(options.steps, 3u);
  }
}

TEST(OperatorOptionsTest, TheDefaultsAreTheDocumentedOnes) {
  const Options options = parse("pause");
  EXPECT_EQ(options.common.domain, 0);
  EXPECT_EQ(options.vehicle_id, 0u);
  EXPECT_EQ(options.timeout_s, 10.0);
  EXPECT_EQ(parse("status").timeout_s, 3.0);
  EXPECT_EQ(parse("status --watch").timeout_s, 10.0);
  EXPECT_EQ(parse("status --timeout-s 7").timeout_s, 7.0);
}

TEST(OperatorOptionsTest, AnUnknownCommandIsRefusedAndNamed) {
  for (const char* line :
       {"", "halt", "pause resume", "pause --watch", "status pause", "step", "step 3 4", "pause 3"})
    EXPECT_NE(find_error(line), "no error") << line;
  EXPECT_NE(find_error("halt").find("halt"), std::string::npos) << find_error("halt");
  EXPECT_NE(find_error("").find("pause, step, "), std::string::npos) << find_error("");
  EXPECT_EQ(find_error("step 0"), "N: expected a whole number, at least 1, got 0");
}

TEST(OperatorOptionsTest, NumbersOutOfRangeAreRefused) {
  for (const char* steps : {"0", "-1", "1.5", "many", "1e3", "18446744073709551616"})
    EXPECT_NE(find_error(std::string("step ") + steps), "no error") << steps;
  EXPECT_EQ(parse("step 18446744073709551615").steps, 18446744073709551615u);
  for (const char* timeout : {"0", "-1", "nan", "inf", "86401", "soon"})
    EXPECT_NE(find_error(std::string("pause --timeout-s ") + timeout), "no error") << timeout;
  for (const char* vehicle : {"-1", "4294967296", "x"})
    EXPECT_NE(find_error(std::string("pause --vehicle ") + vehicle), "no error") << vehicle;
  EXPECT_NE(find_error("pause --domain 233"), "no error");
}

}  // namespace
}  // namespace sls::ctl
