#include "common/model/math.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "common/model/math_constants.hpp"

namespace sls::math {
namespace {

using namespace constants;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::uint64_t to_bits(double x) {
  std::uint64_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}

double from_bits(std::uint64_t bits) {
  double x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

/// A number as a sum: `low` is at most half a unit in the last place of `high`.
struct Sum {
  double high, low;
};

/// a + b without an error. Source: D. E. Knuth, The Art of Computer Programming 2, 4.2.2.
Sum add(double a, double b) {
  const double sum = a + b;
  const double b_held = sum - a;
  return {sum, (a - (sum - b_held)) + (b - b_held)};
}

/// The same for |a| >= |b|, or a = 0. Source: T. J. Dekker, Numerische Mathematik 18 (1971).
Sum add_smaller(double a, double b) {
  const double sum = a + b;
  return {sum, (a - sum) + b};
}

/// The leading 26 bits of x and the other 27: products of two such parts have no error.
Sum halve(double x) {
  const double high = from_bits(to_bits(x) & ~std::uint64_t{0x7ffffff});
  return {high, x - high};
}

/// a b without an error. Source: Dekker.
Sum multiply(double a, double b) {
  const double product = a * b;
  const Sum a_parts = halve(a), b_parts = halve(b);
  const double error = ((a_parts.high * b_parts.high - product) + a_parts.high * b_parts.low +
                        a_parts.low * b_parts.high) +
                       a_parts.low * b_parts.low;
  return {product, error};
}

// ---- sin and cos: x = n π/2 + r with |r| <= π/4 in two parts, then a polynomial in r.

struct Reduced {
  Sum r;
  std::uint64_t quadrant;  ///< n; its last two bits count
};

/// Adding and subtracting it rounds to an integer, which is then held in the last bits.
constexpr double kRounder = 0x1.8p52;

/// For finite x with |x| > π/4. M. H. Payne and R. N. Hanek, SIGNUM Newsletter 18 (1983): multiply
/// the 53 bits of x by those 192 bits of 2/π that decide about the product modulo 4, as integers.
/// The nearest double to a multiple of π/2 is 2^-61 of it away, so that more than 100 bits of r are
/// right.
Reduced reduce_by_integers(double x) {
  constexpr int kLimbs = 6;
  const std::uint64_t bits = to_bits(x);
  const int exponent = static_cast<int>(bits >> 52 & 0x7ff) - 1075;  // |x| = mantissa 2^exponent
  const std::uint64_t mantissa = (bits & 0xfffffffffffff) | 0x10000000000000;
  // 2^exponent 2/π modulo 4: the bits from the one worth 2^(1 − exponent) on, behind the 64 zeros.
  const int first_bit = exponent - 2 + 64;
  std::uint64_t window[kLimbs], product[kLimbs] = {};  // 32 bits each, the most significant first
  for (int i = 0; i < kLimbs; ++i) {
    const int word = first_bit / 32 + i;
    const std::uint64_t pair = std::uint64_t{kTwoOverPiBits[word]} << 32 | kTwoOverPiBits[word + 1];
    window[i] = pair << first_bit % 32 >> 32;
  }
  const std::uint64_t halves[] = {mantissa & 0xffffffff, mantissa >> 32};
  for (int half = 0; half < 2; ++half) {
    std::uint64_t carry = 0;
    for (int i = kLimbs - 1 - half, from = kLimbs - 1; i >= 0; --i, --from) {
      const std::uint64_t sum = halves[half] * window[from] + product[i] + carry;
      product[i] = sum & 0xffffffff;
      carry = sum >> 32;
    }
  }
  std::uint64_t quadrant = product[0] >> 30;
  product[0] &= 0x3fffffff;
  const bool is_above_half = product[0] >> 29;
  if (is_above_half) {  // 1 − fraction, with the other sign
    ++quadrant;
    for (int i = 0; i < kLimbs; ++i) product[i] = ~product[i] & (i == 0 ? 0x3fffffff : 0xffffffff);
  }
  Sum fraction = {0.0, 0.0};
  double worth = 0x1p-30;
  for (int i = 0; i < kLimbs; ++i, worth *= 0x1p-32) {
    const Sum sum = add(fraction.high, static_cast<double>(product[i]) * worth);
    fraction = add_smaller(sum.high, sum.low + fraction.low);
  }
  constexpr Sum kHalfPi = {kPiHigh / 2, kPiLow / 2};
  const Sum leading = multiply(fraction.high, kHalfPi.high);
  Sum r = add_smaller(leading.high,
                      leading.low + (fraction.high * kHalfPi.low + fraction.low * kHalfPi.high));
  if (is_above_half != (x < 0.0)) r = {-r.high, -r.low};
  return {r, x < 0.0 ? 0 - quadrant : quadrant};
}

/// For |x| > π/4.
Reduced reduce(double x) {
  constexpr double kMost = 0x1p20, kNearZero = 0x1p-30;
  if (std::abs(x) < kMost) {
    // Cody and Waite: n has at most 20 bits and the parts of π/2 have 33, 33 and 53. The first two
    // products and the first difference have no error; what is left out is below 2^-98.
    const double rounded = x * kTwoOverPi + kRounder;
    const double n = rounded - kRounder;
    const Sum difference = add(x - n * kHalfPiHigh, -n * kHalfPiMiddle);
    const Sum r = add_smaller(difference.high, difference.low - n * kHalfPiLow);
    if (std::abs(r.high) > kNearZero) return {r, to_bits(rounded)};
  }
  if (!(std::abs(x) < kInfinity)) return {{kNan, kNan}, 0};
  return reduce_by_integers(x);
}

double calc_sine(const Sum& r) {
  const double z = r.high * r.high, z2 = z * z;
  const double tail = (kSine[1] + z * kSine[2]) + z2 * ((kSine[3] + z * kSine[4]) + z2 * kSine[5]);
  const double r3 = z * r.high;
  // sin(high + low) = sin(high) + low cos(high)
  return r.high + (r3 * kSine[0] + (r3 * (z * tail) + (r.low - 0.5 * z * r.low)));
}

double calc_cosine(const Sum& r) {
  const double z = r.high * r.high, z2 = z * z;
  const double tail = (kCosine[0] + z * kCosine[1]) +
                      z2 * ((kCosine[2] + z * kCosine[3]) + z2 * (kCosine[4] + z * kCosine[5]));
  const Sum leading = add_smaller(1.0, -0.5 * z);
  // cos(high + low) = cos(high) − low sin(high)
  return leading.high + (leading.low + (z2 * tail - r.high * r.low));
}

constexpr double kQuarterPi = kPiHigh / 4, kTinyAngle = 0x1p-27;

/// sin(r + quadrant π/2). Both polynomials: a processor does them side by side, and cannot foresee
/// the quadrant.
double choose_sine(const Reduced& x) {
  const double sine = calc_sine(x.r), cosine = calc_cosine(x.r);
  const std::uint64_t chosen = x.quadrant & 1 ? to_bits(cosine) : to_bits(sine);
  return from_bits(chosen ^ (x.quadrant & 2) << 62);
}

}  // namespace

double sin(double x) {
  if (std::abs(x) <= kQuarterPi) return std::abs(x) < kTinyAngle ? x : calc_sine({x, 0.0});
  return choose_sine(reduce(x));
}

double cos(double x) {
  if (std::abs(x) <= kQuarterPi) return calc_cosine({x, 0.0});
  Reduced reduced = reduce(x);
  ++reduced.quadrant;
  return choose_sine(reduced);
}

SineCosine sincos(double x) {
  if (std::abs(x) <= kQuarterPi)
    return {std::abs(x) < kTinyAngle ? x : calc_sine({x, 0.0}), calc_cosine({x, 0.0})};
  const Reduced reduced = reduce(x);
  const double sine = calc_sine(reduced.r), cosine = calc_cosine(reduced.r);
  const bool is_odd = reduced.quadrant & 1;
  const std::uint64_t q = reduced.quadrant;
  return {from_bits(to_bits(is_odd ? cosine : sine) ^ (q & 2) << 62),
          from_bits(to_bits(is_odd ? sine : cosine) ^ ((q + 1) & 2) << 62)};
}

// ---- exp: x = (32 k + i) ln 2 / 32 + r, e^x = 2^k 2^(i/32) e^r. P.-T. P. Tang, ACM TOMS 15
// (1989).

double exp(double x) {
  constexpr double kLeastNormal = -708.0, kGreatest = 709.0;
  const bool is_plain = x > kLeastNormal && x < kGreatest;
  if (!is_plain) {
    if (std::isnan(x)) return x;
    if (x > 710.0) return kInfinity;
    if (x < -746.0) return 0.0;
  }
  const double rounded = x * kExponentialSteps + kRounder;
  const double n = rounded - kRounder;
  const double r = (x - n * kExponentialStepHigh) - n * kExponentialStepLow;
  const double r2 = r * r;
  const double e = r + r2 * ((kExponential[0] + r * kExponential[1]) +
                             r2 * ((kExponential[2] + r * kExponential[3]) + r2 * kExponential[4]));
  const std::uint64_t steps = to_bits(rounded);
  const Power& power = kPowers[steps & 31];
  const double mantissa = power.high + (power.low + power.high * e);
  const std::uint64_t k = static_cast<std::uint64_t>(static_cast<std::int64_t>(steps << 12) >> 17);
  if (is_plain) return from_bits(to_bits(mantissa) + (k << 52));
  // In two factors, of which the second may round to a subnormal number or infinity.
  const double second = x < 0.0 ? 0x1p-100 : 0x1p100;
  const std::uint64_t first = x < 0.0 ? k + 100 : k - 100;
  return from_bits(to_bits(mantissa) + (first << 52)) * second;
}

// ---- log: x = 2^k m, 1/c from a table with so few bits that r = m/c − 1 is exact in two parts,
// log x = k ln 2 + log c + log(1 + r). P.-T. P. Tang, ACM TOMS 16 (1990). Around 1, c is 1 and k is
// 0.

double log(double x) {
  constexpr std::uint64_t kLeastNormal = 0x0010000000000000, kInfinite = 0x7ff0000000000000;
  std::uint64_t bits = to_bits(x);
  std::uint64_t scaled = 0;
  if (bits - kLeastNormal >= kInfinite - kLeastNormal) {
    if (x == 0.0) return -kInfinity;
    if (std::isnan(x) || x == kInfinity) return x;
    if (x < 0.0) return kNan;
    bits = to_bits(x * 0x1p52);
    scaled = 52;
  }
  const std::uint64_t distance = bits - kLogarithmFirst;
  const std::int64_t exponent = static_cast<std::int64_t>(distance) >> 52;
  const Interval& interval = kIntervals[distance >> 45 & 127];
  const double m = from_bits(bits - (static_cast<std::uint64_t>(exponent) << 52));
  const double k = static_cast<double>(exponent - static_cast<std::int64_t>(scaled));
  const double m_high = from_bits(to_bits(m) & ~std::uint64_t{0x7ff});
  const double r_high = m_high * interval.inverse - 1.0;
  const double r_rest = (m - m_high) * interval.inverse;
  const Sum r_parts = add_smaller(r_high, r_rest);
  const double r = r_parts.high;
  const double r2 = r * r;
  const double tail =
      (kLogarithm[0] + r * kLogarithm[1]) +
      r2 * ((kLogarithm[2] + r * kLogarithm[3]) + r2 * (kLogarithm[4] + r * kLogarithm[5]));
  const Sum sum = add_smaller(k * kLogTwoHigh + interval.log_high, r);
  return sum.high + (r2 * tail + (sum.low + (r_parts.low + (k * kLogTwoLow + interval.log_low))));
}

// ---- atan2: with a = |y|, b = |x|, a <= b, and c = i/32 next to a/b, or 0: atan(a/b) = atan c +
// atan t, t = (a − c b) / (b + c a), |t| <= 3/64 for c = 0, otherwise 1/64. The other octants by
// reflection.

namespace {

/// Where a/b is 0/0, inf/inf or so small that the angle to the nearer axis is a/b itself.
double calc_at_axis(double smaller, double greater, bool is_steep, bool is_left) {
  if (smaller == kInfinity) return is_left ? 3 * kQuarterPi : kQuarterPi;
  if (is_steep) return kPiHigh / 2;
  if (is_left) return kPiHigh;
  return smaller == 0.0 ? 0.0 : smaller / greater;
}

/// atan2 of y >= 0, where 2^-60 < |y/x| < 2^60 and products do not overflow.
double calc_angle(double a, double b, const Axis& axis) {
  const auto i = static_cast<int>(a / b * 32.0 + 0.5);
  const double c = i * 0x1p-5;
  const Sum a_parts = halve(a), b_parts = halve(b);
  // c has six bits, so that its products with halves are exact. So is the first difference.
  const Sum above = add(a - c * b_parts.high, -c * b_parts.low);
  const double product = c * a;
  Sum below = add_smaller(b, product);
  below.low += (c * a_parts.high - product) + c * a_parts.low;
  const double inverse = 1.0 / below.high;
  const double t = halve(above.high * inverse).high;  // 26 bits: products with halves are exact
  const Sum below_parts = halve(below.high);
  const double t_low =
      (((above.high - t * below_parts.high) - t * below_parts.low) + (above.low - t * below.low)) *
      inverse;
  const double z = (t + t_low) * (t + t_low);
  const double tail =
      (t + t_low) * z *
      ((kArcTangent[0] + z * kArcTangent[1]) + z * z * (kArcTangent[2] + z * kArcTangent[3]));
  const Angle& angle = kAngles[i];
  const Sum turned = add_smaller(axis.high, axis.sign * angle.high);
  const Sum sum = add_smaller(turned.high, axis.sign * t);
  return sum.high + (sum.low + turned.low + (axis.low + axis.sign * (angle.low + t_low + tail)));
}

}  // namespace

double atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) return x + y;
  const double abs_x = std::abs(x), abs_y = std::abs(y);
  const bool is_steep = abs_y > abs_x, is_left = to_bits(x) >> 63;
  double greater = abs_y > abs_x ? abs_y : abs_x, smaller = abs_y < abs_x ? abs_y : abs_x;
  if (greater == kInfinity || smaller <= greater * 0x1p-60)
    return std::copysign(calc_at_axis(smaller, greater, is_steep, is_left), y);
  if (greater > 0x1p500 || smaller < 0x1p-500) {
    const double scale = greater > 0x1p500 ? 0x1p-600 : 0x1p600;
    greater *= scale, smaller *= scale;
  }
  return std::copysign(calc_angle(smaller, greater, kAxes[is_steep][is_left]), y);
}

// ---- By identities

double tan(double x) {
  const SineCosine at = sincos(x);
  return at.sine / at.cosine;
}

double asin(double x) { return atan2(x, std::sqrt((1.0 - x) * (1.0 + x))); }

double hypot(double x, double y) {
  constexpr double kMost = 0x1p500, kLeast = 0x1p-400;
  const double abs_x = std::abs(x), abs_y = std::abs(y);
  const double greater = abs_x < abs_y ? abs_y : abs_x;
  if (abs_x == kInfinity || abs_y == kInfinity) return kInfinity;
  if (greater > kMost)
    return std::sqrt((x * 0x1p-600) * (x * 0x1p-600) + (y * 0x1p-600) * (y * 0x1p-600)) * 0x1p600;
  if (greater < kLeast)
    return std::sqrt((x * 0x1p600) * (x * 0x1p600) + (y * 0x1p600) * (y * 0x1p600)) * 0x1p-600;
  return std::sqrt(x * x + y * y);
}

double expm1(double x) {
  // W. Kahan: what rounding of u does to u − 1, it does to log u.
  const double u = exp(x);
  if (u == 1.0) return x;
  if (!(std::abs(x) < 1.0)) return u - 1.0;
  return (u - 1.0) * (x / log(u));
}

}  // namespace sls::math
