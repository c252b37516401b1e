// A shared library that changes the floating-point mode of the process when it is loaded. GCC 12
// makes such a one with -ffast-math (crtfastmath.o); later ones link that object into programs
// alone.
#include <xmmintrin.h>

namespace {

__attribute__((constructor)) void set_mode() {
  constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
  _mm_setcsr(_mm_getcsr() | kFlushToZero | kDenormalsAreZero);
}

}  // namespace
