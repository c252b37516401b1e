// Our own elementary functions. A C library chooses its code by the processor, and another version
// rounds otherwise. These use +, −, ×, ÷, square root and integers alone, in a fixed order, so that
// they return the same bits on every processor and C library. Whatever enters a recording uses
// these, not those of <cmath>.
#pragma once

namespace sls::math {

// Errors of sin, cos, exp, log and atan2 are below 1 unit in the last place (`sls_math_error`
// measures them); zeros, infinities, NaN and subnormal numbers are treated as in C99, Annex F.
// errno and floating-point flags are not set. They want rounding to nearest.

double sin(double x);
double cos(double x);

struct SineCosine {
  double sine, cosine;
};
SineCosine sincos(double x);  ///< the same bits as sin(x) and cos(x)

double exp(double x);
double log(double x);
double atan2(double y, double x);

// By identities; errors below 3 units in the last place.

double tan(double x);
double asin(double x);
/// e^x − 1.
double expm1(double x);

/// Length of (x, y), without overflow or underflow of the squares.
double hypot(double x, double y);

}  // namespace sls::math
