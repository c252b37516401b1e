/// A shared library that the user supplies. Every call into it is guarded: error messages name
/// library, function, vehicle and step.
#pragma once

#include <locale.h>

#include <atomic>
#include <csetjmp>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>

namespace sls::plugin {

/// Identifies a call into a library. `library` and `function` must outlive the call.
struct Call {
  const char* library = "";
  const char* function = "";
  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;

  /// `LIBRARY: FUNCTION, vehicle V, step S`.
  std::string describe() const;
};

/// Marks the thread as inside a library while the object exists. If the thread crashes or exits
/// meanwhile, a line on stderr names the call before the process ends. A call that does not return
/// is reported after 2 s. After 60 s, or the time given to `set_patience`, the process ends with
/// exit code 1. Times when the process is stopped (SIGSTOP) do not count.
class CallGuard {
 public:
  /// From here to `put_back`, the thread has the C locale, whatever that of the process.
  CallGuard(const Call& call, bool is_in_flight);
  ~CallGuard();
  CallGuard(const CallGuard&) = delete;
  CallGuard& operator=(const CallGuard&) = delete;

  /// Where a crash continues if there are LastWords: set it by sigsetjmp, then call after_crash.
  sigjmp_buf& place();
  [[noreturn]] void after_crash();

  /// Restores what the call changed outside the library (README.md, "Rules"); returns it, or "".
  std::string put_back();

 private:
  const bool is_in_flight_;
  bool looks_ = false;
  const std::uint64_t floating_point_mode_;
  const locale_t thread_locale_;
};

/// True if other code, such as Python, may change working folder or umask between two calls.
inline std::atomic<bool> expects_changes_between_calls{false};

/// While the object exists, a crash or an exit inside a library calls `call` with the event
/// before the process ends: a recording closes its files. At most one exists.
class LastWords {
 public:
  explicit LastWords(std::function<void(const std::string& reason)> call);
  ~LastWords();
  LastWords(const LastWords&) = delete;
  LastWords& operator=(const LastWords&) = delete;
};

/// Sets the longest time that a call may take from now on, in s.
void set_patience(double seconds);

/// The floating-point mode of this thread: rounding, flush to zero, traps; not the status flags.
std::uint64_t floating_point_mode();
void restore_floating_point_mode(std::uint64_t mode);

/// Prints a warning of one line on stderr.
void warn(const char* message);

/// Calls `work` inside a library.
/// @throws std::runtime_error if the call throws, or changes what CallGuard::put_back restores.
template <class Work>
void call_guarded(const Call& call, const Work& work, bool is_in_flight = true) {
  std::string defect, change;
  {
    CallGuard guard(call, is_in_flight);
    if (sigsetjmp(guard.place(), 0) != 0) guard.after_crash();
    try {
      work();
    } catch (const std::exception& error) {
      defect = std::string("threw an exception: ") + error.what();
    } catch (...) {
      defect = "threw an exception";
    }
    change = guard.put_back();
  }
  if (defect.empty()) defect = change;
  if (!defect.empty()) throw std::runtime_error(call.describe() + ": " + defect);
}

/// The same for `destroy`. An error is only a warning, because nothing can be refused any more.
template <class Work>
void call_at_end(const Call& call, const Work& work) noexcept {
  try {
    call_guarded(call, work, false);
  } catch (const std::exception& error) {
    warn(error.what());
  }
}

/// SHA-256 of `file` at the time when this process loaded it as a SharedLibrary, 64 hex digits;
/// empty if it has not. The file may have been replaced since; the loaded library stays in use.
std::string find_loaded_sha256(const std::filesystem::path& file);

/// True once a SharedLibrary was loaded. Its static objects may have destructors that matter.
bool is_any_loaded();

class SharedLibrary {
 public:
  /// Loads `file`, which stays loaded: later objects of the same path use it again. `place` is
  /// FILE:LINE: KEY of the scenario, for messages.
  /// @throws config::ConfigError if the file is missing, cannot be loaded, or changes itself or
  ///   what CallGuard::put_back restores while loading.
  SharedLibrary(const std::filesystem::path& file, const std::string& place);

  /// Address of `symbol`. @throws config::ConfigError if there is none.
  void* find(const char* symbol) const;

  /// Calls `work` before the flight. @throws config::ConfigError `PLACE: …` if call_guarded throws.
  template <class Work>
  void call(const Call& call, const Work& work) const {
    try {
      call_guarded(call, work, false);
    } catch (const std::exception& error) {
      fail_at_place(error.what());
    }
  }

  /// The path of the file, for messages.
  const std::string& name() const { return name_; }
  /// @throws config::ConfigError `PLACE: LIBRARY: message`.
  [[noreturn]] void fail(const std::string& message) const;

 private:
  void load(const std::string& path);
  [[noreturn]] void fail_at_place(const std::string& message) const;

  std::string name_;
  std::string place_;
  void* handle_ = nullptr;
};

}  // namespace sls::plugin
