#include <errno.h>  // program_invocation_short_name
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <locale>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>
#include <vector>

#include "common/plugin/shared_library.hpp"

namespace sls::plugin {
namespace {

using namespace std::chrono_literals;

constexpr auto kLookEvery = 250ms;
constexpr auto kReportAfter = 2s;

std::atomic<double> patience_s{60.0};

const locale_t kCLocale = ::newlocale(LC_ALL_MASK, "C", nullptr);

/// What it takes 20 µs to look at: where the process makes files, with which rights, and the
/// locale of new C++ streams. A locale with a name is that of the C library, too.
struct SlowState {
  std::locale streams;
  struct stat folder {};
  std::string path;  // of the folder; another process may rename it
  mode_t mask = 0;
};

SlowState look() {
  SlowState state;
  ::stat(".", &state.folder);
  std::error_code ignored;
  state.path = std::filesystem::current_path(ignored).string();
  std::ifstream status("/proc/self/status");  // umask() would set it, for all threads
  for (std::string word; status >> word;)
    if (word == "Umask:") status >> std::oct >> state.mask;
  return state;
}

/// Puts `before` back and returns what was changed, or "".
std::string put_back_slow(const SlowState& before) {
  const SlowState now = look();
  if (now.streams != before.streams) {
    std::locale::global(before.streams);
    return "changed the locale of the process";
  }
  if (now.mask != before.mask) ::umask(before.mask);
  if (now.folder.st_dev == before.folder.st_dev && now.folder.st_ino == before.folder.st_ino)
    return now.mask == before.mask ? "" : "changed the umask of the process";
  [[maybe_unused]] const int failed = ::chdir(before.path.c_str());
  return "changed the working folder of the process";
}

/// State of one thread. `calls` is odd while the thread is inside a library. The watchdog reads it
/// without a lock.
struct ThreadRecord {
  std::atomic<std::uint64_t> calls{0};
  Call call;
  sigjmp_buf place;
  bool has_place = false;
  std::uint64_t calls_in_flight = 0;
  std::string locale;                                // of the C library, before the call
  std::optional<SlowState> slow;                     // before the calls since the last look
  int crash = 0;                                     // the signal
  alignas(16) std::array<char, 16384> signal_stack;  // a stack overflow leaves no room on its own
};

bool is_locale_changed(const ThreadRecord& record) {
  return std::strcmp(::setlocale(LC_ALL, nullptr), record.locale.c_str()) != 0;
}

/// A line of text, built without allocation because signal handlers use it.
class Line {
 public:
  Line& begin(std::string_view level) {
    return add(program_invocation_short_name).add(": ").add(level).add(": ");
  }
  Line& add(std::string_view text) {
    const std::size_t size = std::min(text.size(), text_.size() - size_);
    std::memcpy(text_.data() + size_, text.data(), size);
    size_ += size;
    return *this;
  }
  Line& add(std::uint64_t number) {
    const auto end = std::to_chars(text_.data() + size_, text_.data() + text_.size(), number);
    size_ = static_cast<std::size_t>(end.ptr - text_.data());
    return *this;
  }
  Line& add(const Call& call) {
    return add(call.library)
        .add(": ")
        .add(call.function)
        .add(", vehicle ")
        .add(call.vehicle_id)
        .add(", step ")
        .add(call.step);
  }
  std::string_view text() const { return {text_.data(), size_}; }
  void write_to_stderr() const {
    [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text_.data(), size_);
  }

 private:
  std::array<char, 1024> text_;
  std::size_t size_ = 0;
};

thread_local ThreadRecord* current = nullptr;

std::function<void(const std::string&)> last_words;
std::atomic<bool> has_last_words{false};

bool is_inside_library(const ThreadRecord* record) {
  return record && record->calls.load(std::memory_order_relaxed) % 2 == 1;
}

/// Prints the event inside a library on stderr and calls the LastWords.
void report(Line line, bool may_call) {
  Line().begin("error").add(line.text()).add("\n").write_to_stderr();
  if (may_call && has_last_words.exchange(false)) last_words(std::string(line.text()));
}

Line describe_crash(const ThreadRecord& record, int number) {
  return Line()
      .add(record.call)
      .add(": crashed (signal ")
      .add(static_cast<std::uint64_t>(number))
      .add(")");
}

struct sigaction earlier_bus {};  // what SIGBUS did outside of libraries

void report_crash(int number) {
  if (is_inside_library(current)) {
    // Out of the handler, so that the last words may allocate: CallGuard::after_crash.
    if (current->has_place && has_last_words) {
      current->crash = number;
      siglongjmp(current->place, 1);
    }
    report(describe_crash(*current, number), false);
  }
  // SA_RESETHAND has restored the default action, so the second signal ends the process. abort()
  // itself raises SIGABRT again.
  if (number == SIGABRT) return;
  if (number == SIGBUS) ::sigaction(number, &earlier_bus, nullptr);
  ::raise(number);
}

/// Watches every thread that has called a library. It has its own thread, because a call that does
/// not return blocks the calling thread.
class Watchdog {
 public:
  static Watchdog& instance() {
    static auto* watchdog = new Watchdog;  // never destroyed: its thread outlives main
    return *watchdog;
  }

  void add(ThreadRecord* record) {
    const std::lock_guard lock(mutex_);
    watched_.push_back({record, 0, watched_for_, false});
  }
  void remove(ThreadRecord* record) {
    const std::lock_guard lock(mutex_);
    watched_.erase(std::find_if(watched_.begin(), watched_.end(),
                                [&](const Watched& one) { return one.record == record; }));
  }

 private:
  using Clock = std::chrono::steady_clock;

  struct Watched {
    ThreadRecord* record;
    std::uint64_t calls;
    Clock::duration since;  // in terms of watched_for_
    bool is_reported;
  };

  Watchdog() {
    struct sigaction action {};
    action.sa_handler = &report_crash;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_ONSTACK);
    for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT})
      ::sigaction(number, &action, number == SIGBUS ? &earlier_bus : nullptr);
    std::thread([this] { watch(); }).detach();
  }

  void watch() {
    auto last = Clock::now();
    while (true) {
      std::this_thread::sleep_for(kLookEvery);
      const auto now = Clock::now();
      const std::lock_guard lock(mutex_);
      // A much longer interval means that the whole process was stopped (SIGSTOP, a debugger).
      watched_for_ += std::min<Clock::duration>(now - last, 2 * kLookEvery);
      last = now;
      for (Watched& one : watched_) look(one);
    }
  }

  void look(Watched& one) const {
    const std::uint64_t calls = one.record->calls.load(std::memory_order_acquire);
    if (calls != one.calls || calls % 2 == 0) {
      one = {one.record, calls, watched_for_, false};
      return;
    }
    const auto silence = watched_for_ - one.since;
    const bool is_over = silence >= std::chrono::duration<double>(patience_s);
    if (silence < kReportAfter || (one.is_reported && !is_over)) return;
    one.is_reported = true;
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(silence).count();
    Line()
        .begin(is_over ? "error" : "warning")
        .add(one.record->call)
        .add(": has not returned for ")
        .add(static_cast<std::uint64_t>(seconds))
        .add(is_over ? " s: ends the program\n" : " s\n")
        .write_to_stderr();
    if (is_over) ::_exit(1);
  }

  std::mutex mutex_;  // guards the members below
  std::vector<Watched> watched_;
  Clock::duration watched_for_{0};  // time since the start, without times when stopped
};

/// Registers the thread with the watchdog until the thread ends.
struct Registration {
  Registration() {
    stack_t stack{};
    stack.ss_sp = record.signal_stack.data();
    stack.ss_size = record.signal_stack.size();
    ::sigaltstack(&stack, &others);
    Watchdog::instance().add(&record);
    current = &record;
  }
  ~Registration() {
    // exit() first destroys what belongs to the calling thread.
    if (is_inside_library(&record)) {
      report(Line().add(record.call).add(": ended the program or its thread"), true);
      ::_exit(1);
    }
    current = nullptr;
    ::sigaltstack(&others, nullptr);
    Watchdog::instance().remove(&record);
  }
  ThreadRecord record;
  stack_t others{};  // the thread's signal stack before
};

}  // namespace

std::string Call::describe() const { return std::string(Line().add(*this).text()); }

void set_patience(double seconds) { patience_s = seconds; }

void warn(const char* message) { Line().begin("warning").add(message).add("\n").write_to_stderr(); }

CallGuard::CallGuard(const Call& call, bool is_in_flight)
    : is_in_flight_(is_in_flight),
      floating_point_mode_(floating_point_mode()),
      thread_locale_(::uselocale(kCLocale)) {
  thread_local Registration registration;
  ThreadRecord& record = registration.record;
  const std::uint64_t number = is_in_flight ? ++record.calls_in_flight : 0;
  looks_ = number % 4096 == 0 || (number < 4096 && (number & (number - 1)) == 0);
  if (!record.slow || (looks_ && expects_changes_between_calls)) record.slow = look();
  if (is_locale_changed(record)) record.locale = ::setlocale(LC_ALL, nullptr);
  record.call = call;
  record.calls.fetch_add(1, std::memory_order_release);
}

std::string CallGuard::put_back() {
  std::string change;
  if (floating_point_mode() != floating_point_mode_) {
    restore_floating_point_mode(floating_point_mode_);
    change = "changed the floating-point mode of the thread (rounding, flush to zero or traps)";
  }
  if (::uselocale(thread_locale_) != kCLocale) change = "changed the locale of the thread";
  if (is_locale_changed(*current)) {
    std::locale::global(current->slow->streams);
    ::setlocale(LC_ALL, current->locale.c_str());
    change = "changed the locale of the process";
  }
  if (!looks_) return change;
  const std::string slow = put_back_slow(*current->slow);
  return slow.empty() ? change : slow + (is_in_flight_ ? " in this or an earlier call" : "");
}

CallGuard::~CallGuard() {
  current->has_place = false;
  current->calls.fetch_add(1, std::memory_order_release);
}

sigjmp_buf& CallGuard::place() {
  current->has_place = true;
  return current->place;
}

void CallGuard::after_crash() {
  const int number = current->crash;
  current->has_place = false;  // a second crash ends the process at once
  sigset_t all;
  sigemptyset(&all);
  sigaddset(&all, number);  // blocked in its handler
  pthread_sigmask(SIG_UNBLOCK, &all, nullptr);
  report(describe_crash(*current, number), true);
  ::signal(number, SIG_DFL);
  ::raise(number);
  ::_exit(128 + number);
}

LastWords::LastWords(std::function<void(const std::string& reason)> call) {
  last_words = std::move(call);
  has_last_words = true;
}

LastWords::~LastWords() { has_last_words = false; }

}  // namespace sls::plugin
