#include "common/plugin/shared_library.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cfenv>
#include <chrono>
#include <fstream>
#include <map>
#include <thread>

#include "common/config/config_error.hpp"
#include "common/text/sha256.hpp"
#include "tests/common/plugin/misbehaviour.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::plugin {
namespace {

using namespace std::chrono_literals;

const std::string kFolder = SLS_LIBRARIES "/";

/// The error of loading `file` and finding `symbol` in it, or "no error".
std::string find_error(const std::string& file, const char* symbol = "sls_controller") {
  return sls::test::find_error<config::ConfigError>(
      [&] { SharedLibrary(file, "flight.yaml:7: controller.law").find(symbol); });
}

/// The message of the exception that the call of `work` throws, or "no error".
template <class Work>
std::string find_call_error(const Work& work) {
  return sls::test::find_error<std::runtime_error>([&] {
    call_guarded({"./mine.so", "answer", 3, 41}, work);
  });
}

std::string expected(const std::string& file, const std::string& message) {
  return "flight.yaml:7: controller.law: " + file + ": " + message;
}

TEST(SharedLibraryTest, AMissingFileIsRefused) {
  const sls::test::TemporaryFolder folder;
  const std::string none = folder / "none.so", directory = folder.path();
  EXPECT_EQ(find_error(none),
            expected(none, "expected a shared library, got no file of this name"));
  EXPECT_EQ(find_error(directory),
            expected(directory, "expected a shared library, got no file of this name"));
}

TEST(SharedLibraryTest, AFileThatIsNoLibraryIsRefusedWithTheSystemsReason) {
  const std::string text = kFolder + "text.so", unresolved = kFolder + "unresolved.so";
  EXPECT_EQ(find_error(text), expected(text, "expected a shared library that loads, got: " + text +
                                                 ": file too short"));
  EXPECT_EQ(find_error(unresolved),
            expected(unresolved, "expected a shared library that loads, got: " + unresolved +
                                     ": undefined symbol: sls_test_defined_nowhere"));
}

/// A copy of `empty.so` whose header names another machine, as if it had been built for it.
void write_library_for(unsigned char machine, const std::string& file) {
  std::filesystem::copy(kFolder + "empty.so", file);
  constexpr int kPlaceOfMachine = 18;  // of the ELF header
  std::fstream(file, std::ios::in | std::ios::out | std::ios::binary)
      .seekp(kPlaceOfMachine)
      .put(static_cast<char>(machine))
      .put('\0');
}

TEST(SharedLibraryTest, ALibraryForAnotherProcessorIsRefusedByName) {
#if defined(__x86_64__)
  constexpr unsigned char kOther = 183;
  const std::string own = "x86-64", other = "aarch64";
#else
  constexpr unsigned char kOther = 62;
  const std::string own = "aarch64", other = "x86-64";
#endif
  const sls::test::TemporaryFolder folder;
  const std::string file = folder / "mine.so", unknown = folder / "unknown.so";
  write_library_for(kOther, file);
  EXPECT_EQ(find_error(file),
            expected(file, "expected a shared library for " + own + ", got one for " + other));
  write_library_for(77, unknown);
  EXPECT_EQ(find_error(unknown), expected(unknown, "expected a shared library for " + own +
                                                       ", got one for ELF machine 77"));
}

TEST(SharedLibraryTest, ALibraryThatNeedsANewerSystemIsRefusedWithTheVersion) {
  const std::string file = kFolder + "newer.so";
  const std::string error = find_error(file);
  EXPECT_EQ(error.find(expected(
                file, "expected a shared library built on this system or an older one, got: ")),
            0U)
      << error;
  EXPECT_NE(error.find("libm.so.6: version `GLIBC_9.9' not found (required by " + file + ")"),
            std::string::npos)
      << error;
  EXPECT_EQ(error.find('\n'), std::string::npos) << error;
}

TEST(SharedLibraryTest, ALibraryWithoutTheSymbolIsRefused) {
  const std::string file = kFolder + "empty.so";
  EXPECT_EQ(find_error(file),
            expected(file, "expected a library that defines sls_controller(), got none (" + file +
                               ": undefined symbol: sls_controller)"));
}

TEST(SharedLibraryTest, FastMathIsRefusedWhenItIsLoadedAndTheModePutBack) {
  const std::string file = kFolder + "fast_math.so";
  const std::uint64_t mode = floating_point_mode();
  EXPECT_EQ(find_error(file),
            expected(file,
                     "changed the floating-point mode of the thread (rounding, flush to zero or "
                     "traps) when it was loaded; link it without -ffast-math"));
  EXPECT_EQ(floating_point_mode(), mode);
  EXPECT_NE(find_error(file), "no error") << "also the second time";
}

TEST(SharedLibraryTest, TheHashIsThatOfTheLoadedFileWhenAnotherTakesItsPlace) {
  const sls::test::TemporaryFolder folder;
  const std::filesystem::path file = folder / "mine.so", next = folder / "next.so";
  std::filesystem::copy(kFolder + "empty.so", file);
  EXPECT_EQ(find_loaded_sha256(file), "");
  EXPECT_EQ(find_loaded_sha256({}), "");
  const SharedLibrary loaded(file, "place");
  const std::string sha256 = text::calc_file_sha256(kFolder + "empty.so");
  EXPECT_EQ(find_loaded_sha256(file), sha256);

  std::filesystem::copy(kFolder + "other.so", next);
  std::filesystem::rename(next, file);
  const SharedLibrary again(file, "place");  // as after a reset
  EXPECT_THROW(again.find("sls_test_is_other"), config::ConfigError) << "the old one flies";
  EXPECT_EQ(find_loaded_sha256(file), sha256);
  std::filesystem::remove(file);
  EXPECT_NO_THROW(SharedLibrary(file, "place"));
  EXPECT_EQ(find_loaded_sha256(file), sha256);
}

TEST(SharedLibraryTest, AFileThatChangesWhileItIsLoadedIsRefused) {
  const sls::test::TemporaryFolder folder;
  const std::string file = folder / "mine.so";
  std::filesystem::copy(kFolder + "growing.so", file);
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(find_error(file),
              expected(file, "expected a file that does not change while it is loaded"));
  EXPECT_EQ(find_loaded_sha256(file), "");
}

TEST(CallTest, AnExceptionOfALibraryIsNamedWithItsPlace) {
  EXPECT_EQ(find_call_error([] { sls::test::misbehave("throw"); }),
            "./mine.so: answer, vehicle 3, step 41: threw an exception: out of luck");
  EXPECT_EQ(find_call_error([] { sls::test::misbehave("throw a number"); }),
            "./mine.so: answer, vehicle 3, step 41: threw an exception");
  EXPECT_EQ(find_call_error([] {}), "no error");
}

/// What a library can change outside itself, as text.
std::string describe_state() {
  std::ifstream status("/proc/self/status");
  const std::string text{std::istreambuf_iterator<char>(status), {}};
  const bool is_global = ::uselocale(nullptr) == LC_GLOBAL_LOCALE;
  return text.substr(text.find("Umask:"), 11) + std::filesystem::current_path().string() +
         ::setlocale(LC_ALL, nullptr) + std::locale().name() + std::to_string(is_global) +
         std::to_string(floating_point_mode()) + std::to_string(std::fegetround());
}

TEST(CallTest, AChangeOutsideTheLibraryIsNamedAndPutBack) {
  const std::string mode = "floating-point mode of the thread (rounding, flush to zero or traps)",
                    files = " of the process in this or an earlier call", before = describe_state();
  const std::map<std::string, std::string> changes = {{"round up", mode},
                                                      {"flush to zero", mode},
                                                      {"set locale", "locale of the process"},
                                                      {"set locale of streams", "locale" + files},
                                                      {"use locale", "locale of the thread"},
                                                      {"change folder", "working folder" + files},
                                                      {"change mask", "umask" + files}};
  for (const auto& [how, what] : changes) {
    std::string error = "no error";
    std::thread thread([&, how = how] {  // a new one: not every call looks at folder and umask
      for (int i = 0; i < 200 && error == "no error"; ++i)
        error = find_call_error([&] { sls::test::misbehave(i == 100 ? how : ""); });
    });
    thread.join();
    EXPECT_EQ(error, "./mine.so: answer, vehicle 3, step 41: changed the " + what) << how;
    EXPECT_EQ(describe_state(), before) << how;
  }
}

/// Stops this process for `time`, as a debugger or SIGSTOP does.
void be_stopped_for(std::chrono::milliseconds time) {
  const pid_t helper = ::fork();
  if (helper == 0) {
    ::kill(::getppid(), SIGSTOP);
    std::this_thread::sleep_for(time);
    ::kill(::getppid(), SIGCONT);
    ::_exit(0);
  }
  ::waitpid(helper, nullptr, 0);
}

TEST(CallTest, ACallInAStoppedProcessIsNotTakenForOneThatHangs) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto be_stopped = [] {
    set_patience(4.0);
    call_guarded({"./mine.so", "answer", 3, 41}, [] {
      std::this_thread::sleep_for(600ms);  // the watchdog sees the call
      be_stopped_for(4500ms);
      std::this_thread::sleep_for(600ms);  // and looks again
    });
    ::_exit(0);
  };
  EXPECT_EXIT(be_stopped(), testing::ExitedWithCode(0), "");
}

TEST(CallTest, FlagsOfTheFloatingPointUnitAreNoMode) {
  EXPECT_EQ(find_call_error([] { std::feraiseexcept(FE_ALL_EXCEPT); }), "no error");
}

}  // namespace
}  // namespace sls::plugin
