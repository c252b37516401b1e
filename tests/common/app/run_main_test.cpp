// Exit code and output on stderr and stdout of each outcome.
#include "common/app/run_main.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <new>
#include <sstream>
#include <system_error>
#include <thread>
#include <vector>

#include "common/app/run_error.hpp"
#include "common/app/version.hpp"
#include "common/config/config_error.hpp"

namespace sls::app {
namespace {

struct Outcome {
  int code = -1;
  std::string out, err;
  bool worked = false;
  CommonOptions options;
};

/// Runs a program "program" with `arguments` and the work `work`.
Outcome run(
    std::vector<std::string> arguments, const std::function<void()>& work = [] {}) {
  Outcome outcome;
  outcome.options.qos_file = "/somewhere/default.xml";
  CommandLine cli("Does something.");
  cli.add_common_options(outcome.options);
  std::string needed = "value";
  cli.add_option("--needed", needed, "its own option").type_name("TEXT");
  double number = 0.0;
  cli.app().add_option("--number", number,
                       "a number with a meaning that does not fit into one line of a terminal");
  cli.app().add_subcommand("pause");
  cli.app().add_subcommand("resume");
  arguments.insert(arguments.begin(), "program");
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  outcome.code =
      run_main(static_cast<int>(argv.size()), argv.data(), cli, outcome.options, "program", [&] {
        outcome.worked = true;
        work();
      });
  outcome.out = testing::internal::GetCapturedStdout();
  outcome.err = testing::internal::GetCapturedStderr();
  return outcome;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

bool is_one_line(const std::string& text) {
  return !text.empty() && text.find('\n') == text.size() - 1;
}

TEST(RunMainTest, DoneIsExitCodeZeroWithoutOutput) {
  const Outcome outcome = run({});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_TRUE(outcome.worked);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(outcome.err, "");
}

TEST(RunMainTest, AConfigurationErrorIsTwo) {
  const Outcome outcome = run({}, [] { throw config::ConfigError("file.yaml:7: key: bad {}"); });
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(outcome.err, "program: error: file.yaml:7: key: bad {}\n");
  EXPECT_EQ(outcome.out, "");
}

TEST(RunMainTest, AFailedRunIsOne) {
  const Outcome outcome = run({}, [] { throw RunError("the recorder is gone"); });
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.err, "program: error: the recorder is gone\n");
}

TEST(RunMainTest, AnyOtherExceptionIsOne) {
  EXPECT_EQ(run({}, [] { throw std::runtime_error("x"); }).code, 1);
  EXPECT_EQ(run({}, [] { throw std::bad_alloc(); }).code, 1);
  EXPECT_EQ(run({}, [] { throw std::system_error(ENOSPC, std::generic_category(), "f"); }).code, 1);
  const Outcome odd = run({}, [] { throw 42; });
  EXPECT_EQ(odd.code, 1);
  EXPECT_TRUE(is_one_line(odd.err)) << odd.err;
}

TEST(RunMainTest, BadUsageIsTwoWithoutWork) {
  const std::vector<std::vector<std::string>> bad = {{"--unknown"},
                                                     {"--domain"},
                                                     {"--domain", "233"},
                                                     {"--domain", "-1"},
                                                     {"--domain", "ten"},
                                                     {"--log-level", "loud"},
                                                     {"stray"},
                                                     {"--domain", "1", "2"},
                                                     {"--domain", ""},
                                                     {"--domain", "1.5"},
                                                     {"--domain", "99999999999999999999"}};
  for (const auto& arguments : bad) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments.back();
    EXPECT_FALSE(outcome.worked);
    EXPECT_TRUE(is_one_line(outcome.err)) << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "program: error: ")) << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "--help")) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
}

TEST(RunMainTest, BadUsageSaysWhatWasExpectedAndWhatCame) {
  const auto refuse = [](const std::vector<std::string>& arguments, const std::string& line) {
    EXPECT_EQ(run(arguments).err, "program: error: " + line + " (see --help)\n");
  };
  refuse({"--domain", "233"}, "--domain: expected 0 to 232, got '233'");
  refuse({"--domain", "ten"}, "--domain: expected 0 to 232, got 'ten'");
  refuse({"--domain"}, "--domain: expected a value");
  refuse({"--number", "4ms"}, "--number: expected a number, got '4ms'");
  refuse({"--log-level", "loud"},
         "--log-level: expected debug, info, warning or error, got 'loud'");
  refuse({"--domian", "3"}, "unknown option '--domian'; did you mean '--domain'?");
  refuse({"--zzz"}, "unknown option '--zzz'");
  refuse({"paus"}, "expected pause or resume, got 'paus'; did you mean 'pause'?");
  refuse({"pause", "now"}, "expected no further argument, got 'now'");
  ::setenv("SLS_DOMAIN", "abc", 1);
  refuse({}, "SLS_DOMAIN: expected 0 to 232, got 'abc'");
  refuse({"--domain", "one"}, "--domain: expected 0 to 232, got 'one'");
  ::unsetenv("SLS_DOMAIN");
}

TEST(RunMainTest, HelpFitsIn80Columns) {
  const std::string help = run({"--help"}).out;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
  std::istringstream words(help);
  std::string text;
  for (std::string word; words >> word;) text += " " + word;
  EXPECT_NE(text.find(" a number with a meaning that does not fit into one line of a terminal"),
            text.npos);
}

TEST(RunMainTest, OptionsArriveWhereTheyBelong) {
  const Outcome outcome = run({"--qos", "my.xml", "--domain", "232", "--log-level", "debug"},
                              [] { spdlog::debug("d"); });
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.options.qos_file, "my.xml");
  EXPECT_EQ(outcome.options.domain, 232);
  EXPECT_EQ(outcome.err, "program: d\n");
}

TEST(RunMainTest, TheLogLevelOfTheUserIsInForce) {
  const auto log = [] {
    spdlog::info("i");
    spdlog::warn("w");
  };
  EXPECT_EQ(run({}, log).err, "program: i\nprogram: warning: w\n");
  EXPECT_EQ(run({"--log-level", "warning"}, log).err, "program: warning: w\n");
}

TEST(RunMainTest, HelpPrintsEveryFlagWithItsDefaultOnStdout) {
  const Outcome outcome = run({"--help"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_FALSE(outcome.worked);
  EXPECT_EQ(outcome.err, "");
  for (const char* part :
       {"Does something.", "--domain N", "--log-level LEVEL", "--version", "its own option"})
    EXPECT_TRUE(contains(outcome.out, part)) << part << "\n" << outcome.out;
  using Default = std::pair<std::string, std::string>;
  for (const auto& [flag, value] :
       {Default{"--qos FILE", "/somewhere/default.xml"}, Default{"[0 - 232]", "0"},
        Default{"}", "info"}, Default{"--needed TEXT", "value"}})
    // CLI11 2.1 writes FLAG=VALUE, 2.4 FLAG [VALUE].
    EXPECT_TRUE(contains(outcome.out, flag + "=" + value) ||
                contains(outcome.out, flag + " [" + value + "]"))
        << flag << "\n"
        << outcome.out;
}

TEST(RunMainTest, VersionGoesToStdout) {
  const Outcome outcome = run({"--version"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_FALSE(outcome.worked);
  EXPECT_EQ(outcome.out, version() + "\n");
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(version().rfind("sls ", 0), 0u);
}

// The flag of a signal lasts as long as its process: each test runs in its own process.
class RunMainDeathTest : public testing::Test {
 protected:
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

/// Runs `work` in this process and ends it with the exit code.
void run_and_exit(const std::function<void()>& work) {
  char name[] = "program";
  char* argv[] = {name};
  CommandLine cli("Does something.");
  std::exit(run_main(1, argv, cli, {}, "program", work));
}

TEST_F(RunMainDeathTest, AFileIsNeverOpenedUnderTheNumberOfAClosedStandardStream) {
  EXPECT_EXIT(
      {
        for (const int number : {0, 1, 2}) ::close(number);
        run_and_exit([] { std::_Exit(::open("/dev/null", O_RDONLY) > 2 ? kExitDone : 1); });
      },
      testing::ExitedWithCode(kExitDone), "");
}

TEST_F(RunMainDeathTest, ALimitOfTheSystemIsNamedInWhateverThreadItIsMet) {
  const auto no_thread = [] {
    throw std::system_error(EAGAIN, std::generic_category(), "Resource temporarily unavailable");
  };
  const auto no_memory = [] { throw std::bad_alloc(); };
  EXPECT_EXIT(run_and_exit(no_thread), testing::ExitedWithCode(kExitRunFailed),
              "^program: error: expected another thread, got none[^\n]*\n$");
  EXPECT_EXIT(run_and_exit(no_memory), testing::ExitedWithCode(kExitRunFailed),
              "^program: error: expected more memory, got none[^\n]*\n$");
  EXPECT_EXIT(run_and_exit([&] { std::thread(no_memory).join(); }),
              testing::ExitedWithCode(kExitRunFailed),
              "^program: error: expected more memory, got none[^\n]*\n$");
}

TEST_F(RunMainDeathTest, InterruptedIs130And143HoweverTheWorkEnds) {
  const auto end_well = [] {};
  const auto fail = [] { throw RunError("interrupted"); };
  for (const auto& [number, code] : {std::pair{SIGINT, 130}, std::pair{SIGTERM, 143}})
    for (const std::function<void()>& end :
         {std::function<void()>(end_well), std::function<void()>(fail)})
      EXPECT_EXIT(
          {
            const Outcome outcome = run({}, [&, signal = number] {
              std::raise(signal);
              end();
            });
            std::exit(outcome.code);
          },
          testing::ExitedWithCode(code), "");
}

}  // namespace
}  // namespace sls::app
