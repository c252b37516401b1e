#include "common/plugin/shared_library.hpp"

#include <dlfcn.h>
#include <elf.h>

#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <system_error>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "common/config/config_error.hpp"
#include "common/text/sha256.hpp"

namespace sls::plugin {
namespace {

struct Loaded {
  void* handle;
  std::string sha256;
};

/// The loaded libraries by absolute path. Like dlopen, which does not open a path again while its
/// library is loaded, even if another file has taken its place.
struct LoadedLibraries {
  std::mutex mutex;  // guards `by_path`
  std::map<std::string, Loaded> by_path;
};

LoadedLibraries& loaded_libraries() {
  static LoadedLibraries libraries;
  return libraries;
}

#if defined(__x86_64__)
constexpr unsigned kOwnMachine = EM_X86_64;
#elif defined(__aarch64__)
constexpr unsigned kOwnMachine = EM_AARCH64;
#endif

std::string to_name(unsigned machine) {
  switch (machine) {
    case EM_X86_64:
      return "x86-64";
    case EM_AARCH64:
      return "aarch64";
    case EM_386:
      return "i386";
    case EM_ARM:
      return "32-bit ARM";
    case EM_RISCV:
      return "RISC-V";
    default:
      return "ELF machine " + std::to_string(machine);
  }
}

/// The machine of an ELF file of this byte order; ours for any other file, which dlopen refuses.
unsigned read_machine(const std::string& path) {
  // e_machine has the same place in files of 32 and of 64 bits.
  Elf64_Ehdr header{};
  std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(&header), sizeof(header));
  const bool is_elf = std::memcmp(header.e_ident, ELFMAG, SELFMAG) == 0;
  return is_elf && header.e_ident[EI_DATA] == ELFDATA2LSB && header.e_machine != EM_NONE
             ? header.e_machine
             : kOwnMachine;
}

/// True if the library needs a newer C or C++ library than this system has.
bool is_for_newer_system(const std::string& error) {
  return error.find(": version `") != std::string::npos &&
         error.find(" not found (required by ") != std::string::npos;
}

}  // namespace

std::uint64_t floating_point_mode() {
#if defined(__x86_64__)
  constexpr unsigned kModeBits = 0xFFC0;  // of MXCSR; those below are status flags
  std::uint16_t x87 = 0;
  asm volatile("fnstcw %0" : "=m"(x87));
  return (std::uint64_t{x87} << 32) | (_mm_getcsr() & kModeBits);
#elif defined(__aarch64__)
  std::uint64_t mode = 0;
  asm volatile("mrs %0, fpcr" : "=r"(mode));
  return mode;
#else
#error "floating_point_mode: not written for this processor"
#endif
}

void restore_floating_point_mode(std::uint64_t mode) {
#if defined(__x86_64__)
  const auto x87 = static_cast<std::uint16_t>(mode >> 32);
  asm volatile("fldcw %0" : : "m"(x87));
  _mm_setcsr(static_cast<unsigned>(mode & 0xFFFF));
#elif defined(__aarch64__)
  asm volatile("msr fpcr, %0" : : "r"(mode));
#endif
}

bool is_any_loaded() {
  LoadedLibraries& libraries = loaded_libraries();
  const std::lock_guard lock(libraries.mutex);
  return !libraries.by_path.empty();
}

SharedLibrary::SharedLibrary(const std::filesystem::path& file, const std::string& place)
    : name_(file.lexically_normal().string()), place_(place) {
  LoadedLibraries& libraries = loaded_libraries();
  const std::lock_guard lock(libraries.mutex);
  // The path is absolute because the loader searches the system's folders for one without a slash.
  const std::string path = std::filesystem::absolute(file).string();
  const auto known = libraries.by_path.find(path);
  if (known != libraries.by_path.end()) {
    handle_ = known->second.handle;
    return;
  }
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    fail("expected a shared library, got no file of this name");
  try {
    const std::string sha256 = text::calc_file_sha256(path);
    load(path);
    if (text::calc_file_sha256(path) != sha256) {
      ::dlclose(handle_);
      fail("expected a file that does not change while it is loaded");
    }
    libraries.by_path[path] = {handle_, sha256};
  } catch (const std::system_error& error) {
    fail(std::string("expected a file that can be read, got: ") + error.what());
  }
}

void SharedLibrary::load(const std::string& path) {
  // dlopen says "No such file or directory" of a library for another machine.
  if (const unsigned machine = read_machine(path); machine != kOwnMachine)
    fail("expected a shared library for " + to_name(kOwnMachine) + ", got one for " +
         to_name(machine));
  std::string change;
  {
    CallGuard guard({name_.c_str(), "(loading)", 0, 0}, false);
    handle_ = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    change = guard.put_back();
  }
  if (!change.empty()) {
    if (handle_) ::dlclose(handle_);
    const bool is_fast_math = change.find("floating-point") != change.npos;
    fail(change + " when it was loaded" + (is_fast_math ? "; link it without -ffast-math" : ""));
  }
  if (handle_) return;
  const std::string error = ::dlerror();
  fail((is_for_newer_system(error) ? "expected a shared library built on this system or an older "
                                     "one, got: "
                                   : "expected a shared library that loads, got: ") +
       error);
}

std::string find_loaded_sha256(const std::filesystem::path& file) {
  if (file.empty()) return "";
  LoadedLibraries& libraries = loaded_libraries();
  const std::lock_guard lock(libraries.mutex);
  const auto known = libraries.by_path.find(std::filesystem::absolute(file).string());
  return known == libraries.by_path.end() ? "" : known->second.sha256;
}

void* SharedLibrary::find(const char* symbol) const {
  void* address = ::dlsym(handle_, symbol);
  if (!address)
    fail(std::string("expected a library that defines ") + symbol + "(), got none (" + ::dlerror() +
         ")");
  return address;
}

void SharedLibrary::fail(const std::string& message) const {
  fail_at_place(name_ + ": " + message);
}

void SharedLibrary::fail_at_place(const std::string& message) const {
  throw config::ConfigError(place_ + ": " + message);
}

}  // namespace sls::plugin
