// Libraries that must be refused, or of which only the way they are linked matters: each is this
// file with one of these definitions, or with none.
#include <dlfcn.h>

#include <fstream>

#include "tests/common/plugin/misbehaviour.hpp"

#if defined(TEST_UNRESOLVED)
extern "C" int sls_test_defined_nowhere();
extern "C" int sls_test_calls_it() { return sls_test_defined_nowhere(); }
#elif defined(TEST_OTHER)
extern "C" void sls_test_is_other() {}
#elif defined( \
    TEST_FUTURE_LIBM)      // the C library of a system that is newer than any: only to be linked
extern "C" double sls_test_function_of_the_future(double x);
extern "C" double sls_test_function_of_the_future(double x) { return x; }
#elif defined(TEST_NEWER)  // needs it
extern "C" double sls_test_function_of_the_future(double x);
extern "C" double sls_test_value();
extern "C" double sls_test_value() { return sls_test_function_of_the_future(1.0); }
#elif defined(TEST_CRASHING_AT_LOAD)
namespace {
const int kNothing = (sls::test::misbehave("crash"), 0);
}
#elif defined(TEST_GROWING)  // appends a byte to its own file while it is loaded
namespace {

int grow() {
  Dl_info self{};
  ::dladdr(reinterpret_cast<void*>(&grow), &self);
  std::ofstream(self.dli_fname, std::ios::binary | std::ios::app) << '\n';
  return 0;
}

const int kNothing = grow();

}  // namespace
#elif defined(TEST_FAST_MATH)
// Changes the floating-point mode of the process when it is loaded. GCC 12 makes such a library
// with -ffast-math (crtfastmath.o); later ones link that object into programs alone.
#include <xmmintrin.h>

namespace {

__attribute__((constructor)) void set_mode() {
  constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
  _mm_setcsr(_mm_getcsr() | kFlushToZero | kDenormalsAreZero);
}

}  // namespace
#endif
