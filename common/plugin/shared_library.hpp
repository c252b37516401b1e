/// A shared library of the user's own. Every call into it is guarded: what it does wrong is named
/// with library, function, vehicle and step.
#pragma once

#include <cstdint>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace sls::plugin {

/// Where a call into a library stands. `library` and `function` must outlive the call.
struct Call {
  const char* library = "";
  const char* function = "";
  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;

  /// `LIBRARY: FUNCTION, vehicle V, step S`.
  std::string describe() const;
};

/// Marks the thread as being inside a library while it lives. If the process crashes meanwhile, it
/// says where on stderr before it ends; if the call does not return, it says so after 2 s, and ends
/// the process with exit code 1 after 60 s, or what `set_patience` said last.
class CallGuard {
 public:
  explicit CallGuard(const Call& call);
  ~CallGuard();
  CallGuard(const CallGuard&) = delete;
  CallGuard& operator=(const CallGuard&) = delete;
};

/// How long a call may take from now on.
void set_patience(double seconds);

/// The floating-point mode of this thread: rounding, flush to zero, traps; not the status flags.
std::uint64_t floating_point_mode();
void restore_floating_point_mode(std::uint64_t mode);

/// One line on stderr.
void warn(const char* message);

/// Calls `work` inside a library.
/// @throws std::runtime_error if the call throws, or changes the floating-point mode (which is then
///   put back).
template <class Work>
void call_guarded(const Call& call, const Work& work) {
  const std::uint64_t mode = floating_point_mode();
  std::string defect;
  {
    const CallGuard guard(call);
    try {
      work();
    } catch (const std::exception& error) {
      defect = std::string("threw an exception: ") + error.what();
    } catch (...) {
      defect = "threw an exception";
    }
  }
  if (floating_point_mode() != mode) {
    restore_floating_point_mode(mode);
    if (defect.empty())
      defect = "changed the floating-point mode of the thread (rounding, flush to zero or traps)";
  }
  if (!defect.empty()) throw std::runtime_error(call.describe() + ": " + defect);
}

/// The same for `destroy`, after which nothing can be refused: what goes wrong is a warning.
template <class Work>
void call_at_end(const Call& call, const Work& work) noexcept {
  try {
    call_guarded(call, work);
  } catch (const std::exception& error) {
    warn(error.what());
  }
}

class SharedLibrary {
 public:
  /// Loads `file`. `place` is FILE:LINE: KEY of the scenario, for messages; it stays loaded.
  /// @throws config::ConfigError if it is missing, cannot be loaded or changes the floating-point
  ///   mode while it is.
  SharedLibrary(const std::filesystem::path& file, const std::string& place);

  /// Address of `symbol`. @throws config::ConfigError if there is none.
  void* find(const char* symbol) const;

  /// Calls `work` before the flight. @throws config::ConfigError `PLACE: …` as call_guarded.
  template <class Work>
  void call(const Call& call, const Work& work) const {
    try {
      call_guarded(call, work);
    } catch (const std::exception& error) {
      fail_at_place(error.what());
    }
  }

  /// The path of the file, for messages.
  const std::string& name() const { return name_; }
  /// @throws config::ConfigError `PLACE: LIBRARY: message`.
  [[noreturn]] void fail(const std::string& message) const;

 private:
  [[noreturn]] void fail_at_place(const std::string& message) const;

  std::string name_;
  std::string place_;
  void* handle_ = nullptr;
};

}  // namespace sls::plugin
