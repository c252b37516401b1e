/// LD_PRELOAD library that counts calls of the C library's elementary functions, whose last bits
/// depend on the processor and on the version of the library. When the process ends it writes a
/// line per function that was called into the file that SLS_MATH_CALLS names: its name, the number
/// of calls and the file with the last caller. No line: no call.
#include <dlfcn.h>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace {

/// Calls of one function.
struct Calls {
  explicit Calls(const char* function) : name(function), next(all) { all = this; }
  void count(void* from) {
    ++number;
    caller = from;
  }

  const char* const name;
  Calls* const next;
  std::atomic<std::uint64_t> number{0};
  std::atomic<void*> caller{nullptr};
  static Calls* all;
};
Calls* Calls::all = nullptr;

template <class Function>
Function find_original(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

__attribute__((destructor)) void report() {
  const char* const path = std::getenv("SLS_MATH_CALLS");
  std::FILE* const file = path ? std::fopen(path, "w") : nullptr;
  if (!file) return;
  for (const Calls* calls = Calls::all; calls; calls = calls->next) {
    if (calls->number == 0) continue;
    Dl_info caller{};
    dladdr(calls->caller, &caller);
    std::fprintf(file, "%s %llu %s\n", calls->name, static_cast<unsigned long long>(calls->number),
                 caller.dli_fname ? caller.dli_fname : "?");
  }
  std::fclose(file);
}

}  // namespace

// `types` are the parameters with their names, `names` the arguments.
#define SLS_COUNT(Result, name, types, names)                            \
  extern "C" Result name types {                                         \
    static Calls calls(#name);                                           \
    static auto* const original = find_original<Result(*) types>(#name); \
    calls.count(__builtin_return_address(0));                            \
    return original names;                                               \
  }
#define SLS_COUNT_ONE(name)                \
  SLS_COUNT(double, name, (double x), (x)) \
  SLS_COUNT(float, name##f, (float x), (x))
#define SLS_COUNT_TWO(name)                             \
  SLS_COUNT(double, name, (double x, double y), (x, y)) \
  SLS_COUNT(float, name##f, (float x, float y), (x, y))

SLS_COUNT_ONE(sin)
SLS_COUNT_ONE(cos)
SLS_COUNT_ONE(tan)
SLS_COUNT_ONE(asin)
SLS_COUNT_ONE(acos)
SLS_COUNT_ONE(atan)
SLS_COUNT_ONE(sinh)
SLS_COUNT_ONE(cosh)
SLS_COUNT_ONE(tanh)
SLS_COUNT_ONE(asinh)
SLS_COUNT_ONE(acosh)
SLS_COUNT_ONE(atanh)
SLS_COUNT_ONE(exp)
SLS_COUNT_ONE(exp2)
SLS_COUNT_ONE(exp10)
SLS_COUNT_ONE(expm1)
SLS_COUNT_ONE(log)
SLS_COUNT_ONE(log2)
SLS_COUNT_ONE(log10)
SLS_COUNT_ONE(log1p)
SLS_COUNT_ONE(cbrt)
SLS_COUNT_ONE(erf)
SLS_COUNT_ONE(erfc)
SLS_COUNT_ONE(tgamma)
SLS_COUNT_ONE(lgamma)
SLS_COUNT_TWO(atan2)
SLS_COUNT_TWO(pow)
SLS_COUNT_TWO(hypot)
SLS_COUNT(double, fma, (double x, double y, double z), (x, y, z))
SLS_COUNT(void, sincos, (double x, double* sine, double* cosine), (x, sine, cosine))
SLS_COUNT(void, sincosf, (float x, float* sine, float* cosine), (x, sine, cosine))
