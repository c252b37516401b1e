/// Errors that the tests' libraries make in any of their functions.
#pragma once

#include <locale.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cfenv>
#include <cstdlib>
#include <locale>
#include <stdexcept>
#include <string>

namespace sls::test {

/// The value of `key` in our JSON, `"key": VALUE`, without its quotes; "" if there is none.
inline std::string find_parameter(const std::string& json, const std::string& key) {
  const std::string mark = "\"" + key + "\": ";
  const auto at = json.find(mark);
  if (at == json.npos) return "";
  std::string value = json.substr(at + mark.size());
  const bool is_text = value[0] == '"';
  if (is_text) value.erase(0, 1);
  return value.substr(0, value.find_first_of(is_text ? "\"" : ",}"));
}

/// Overflows the stack. The compiler can neither use a tail call nor find the recursion endless.
inline int overflow_stack(volatile int depth) {
  volatile char frame[4096];
  frame[0] = static_cast<char>(depth);
  return depth < 0 ? 0 : overflow_stack(depth + 1) + frame[0];
}

inline void misbehave(const std::string& how) {
  if (how == "throw") throw std::runtime_error("out of luck");
  if (how == "throw a number") throw 42;
  static volatile int* volatile nowhere = nullptr;  // unknown to the compiler
  if (how == "crash") *nowhere = 1;
  if (how == "dawdle") ::usleep(30'000);
  if (how == "abort") std::abort();
  if (how == "exit") std::exit(0);
  if (how == "overflow the stack") overflow_stack(0);
  if (how == "hang")
    while (true) ::pause();
  if (how == "set locale") ::setlocale(LC_NUMERIC, "C.UTF-8");
  if (how == "set locale of streams") std::locale::global({std::locale(), new std::numpunct<char>});
  if (how == "use locale") ::uselocale(LC_GLOBAL_LOCALE);
  if (how == "change folder" && ::chdir("/") != 0) std::abort();
  if (how == "change mask") ::umask(0177);
  if (how == "round up") std::fesetround(FE_UPWARD);
#if defined(__x86_64__)
  if (how == "flush to zero") __builtin_ia32_ldmxcsr(__builtin_ia32_stmxcsr() | 0x8000);
#endif
}

}  // namespace sls::test
