#include "tests/oracle/math_errors.hpp"

#include <mpfr.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "common/model/math.hpp"

namespace sls::test {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr mpfr_prec_t kBits = 140;

struct Point {
  double x, y;
};

/// Random numbers from the bits of the generator alone.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : generator_(seed) {}

  std::uint64_t below(std::uint64_t limit) { return generator_() % limit; }
  double in(double low, double high) {
    return low + (high - low) * (static_cast<double>(generator_() >> 11) * 0x1p-53);
  }
  double sign() { return below(2) == 0 ? 1.0 : -1.0; }
  /// Of either sign, every exponent from `least` to `greatest` as likely.
  double of_exponent(int least, int greatest) {
    const int span = greatest - least + 1;
    return sign() * std::ldexp(in(1.0, 2.0), least + static_cast<int>(below(span)));
  }
  double finite() {
    for (;;) {
      const std::uint64_t bits = generator_();
      double x;
      std::memcpy(&x, &bits, sizeof x);
      if (std::isfinite(x)) return x;
    }
  }
  /// x or one of the numbers next to it.
  double near(double x) {
    const double towards = sign() * std::numeric_limits<double>::infinity();
    for (std::uint64_t i = below(4); i > 0; --i) x = std::nextafter(x, towards);
    return x;
  }

 private:
  std::mt19937_64 generator_;
};

Point draw_angle(Draw& draw) {
  switch (draw.below(6)) {
    case 0:
      return {draw.in(-kPi, kPi), 0};
    case 1:
      return {draw.in(-100.0, 100.0), 0};
    case 2:
      return {draw.in(-4e6, 4e6), 0};
    case 3:
      return {draw.finite(), 0};
    case 4:
      return {draw.of_exponent(-40, 60), 0};
    default: {  // near multiples of π/4
      const auto count = static_cast<double>(draw.below(std::uint64_t{1} << (1 + draw.below(40))));
      return {draw.sign() * draw.near(count * (kPi / 4)), 0};
    }
  }
}

Point draw_exponent(Draw& draw) {
  switch (draw.below(5)) {
    case 0:
      return {draw.in(-1.0, 1.0), 0};
    case 1:
      return {draw.in(-745.2, 709.8), 0};
    case 2:
      return {draw.of_exponent(-60, 9), 0};
    case 3:
      return {draw.in(-745.2, -707.0), 0};
    default:  // between two entries of the table
      return {draw.near((static_cast<double>(draw.below(2000)) - 999.5) * (std::log(2.0) / 32)), 0};
  }
}

Point draw_positive(Draw& draw) {
  switch (draw.below(5)) {
    case 0:
      return {draw.in(0.5, 2.0), 0};
    case 1:
      return {1.0 + draw.of_exponent(-54, -4), 0};
    case 2:
      return {std::abs(draw.finite()), 0};
    case 3:
      return {draw.in(0.97, 1.03), 0};
    default:
      return {std::abs(draw.of_exponent(-30, 30)), 0};
  }
}

Point draw_vector(Draw& draw) {
  switch (draw.below(6)) {
    case 0:
      return {draw.in(-1.0, 1.0), draw.in(-1.0, 1.0)};
    case 1:
      return {draw.finite(), draw.finite()};
    case 2: {
      const double x = draw.finite();  // often huge or subnormal
      return {x, x * draw.of_exponent(-70, 70)};
    }
    case 3:
      return {draw.in(-1.0, 1.0), draw.of_exponent(-60, 2)};
    case 4:
      return {draw.of_exponent(-60, 2), draw.in(-1.0, 1.0)};
    default: {  // between two entries of the table
      const double x = draw.in(1.0, 2.0);
      const double y = draw.near(x * ((0.5 + static_cast<double>(draw.below(32))) / 32));
      return draw.below(2) == 0 ? Point{draw.sign() * x, y} : Point{draw.sign() * y, x};
    }
  }
}

Point draw_sine(Draw& draw) {
  switch (draw.below(3)) {
    case 0:
      return {draw.in(-1.0, 1.0), 0};
    case 1:
      return {draw.sign() * (1.0 - std::abs(draw.of_exponent(-53, -2))), 0};
    default:
      return {draw.of_exponent(-300, -1), 0};
  }
}

struct Function {
  const char* name;
  Point (*draw)(Draw&);
  double (*calc)(const Point&);
  int (*calc_exactly)(mpfr_ptr result, mpfr_srcptr x, mpfr_srcptr y);
};

template <int function(mpfr_ptr, mpfr_srcptr, mpfr_rnd_t)>
int of_one(mpfr_ptr result, mpfr_srcptr x, mpfr_srcptr) {
  return function(result, x, MPFR_RNDN);
}

const Function kFunctions[] = {
    {"sin", draw_angle, [](const Point& p) { return math::sin(p.x); }, of_one<mpfr_sin>},
    {"cos", draw_angle, [](const Point& p) { return math::cos(p.x); }, of_one<mpfr_cos>},
    {"exp", draw_exponent, [](const Point& p) { return math::exp(p.x); }, of_one<mpfr_exp>},
    {"log", draw_positive, [](const Point& p) { return math::log(p.x); }, of_one<mpfr_log>},
    {"atan2", draw_vector, [](const Point& p) { return math::atan2(p.y, p.x); },
     [](mpfr_ptr result, mpfr_srcptr x, mpfr_srcptr y) {
       return mpfr_atan2(result, y, x, MPFR_RNDN);
     }},
    {"tan", draw_angle, [](const Point& p) { return math::tan(p.x); }, of_one<mpfr_tan>},
    {"asin", draw_sine, [](const Point& p) { return math::asin(p.x); }, of_one<mpfr_asin>},
    {"hypot", draw_vector, [](const Point& p) { return math::hypot(p.x, p.y); },
     [](mpfr_ptr result, mpfr_srcptr x, mpfr_srcptr y) {
       return mpfr_hypot(result, x, y, MPFR_RNDN);
     }},
    {"expm1", draw_exponent, [](const Point& p) { return math::expm1(p.x); }, of_one<mpfr_expm1>},
};

}  // namespace

std::vector<GreatestError> find_greatest_errors(std::int64_t count, std::uint64_t seed) {
  std::vector<GreatestError> errors;
  mpfr_t x, y, exact;
  mpfr_inits2(kBits, x, y, exact, nullptr);
  for (const Function& function : kFunctions) {
    Draw draw(seed);
    GreatestError greatest;
    greatest.function = function.name;
    for (std::int64_t i = 0; i < count; ++i) {
      const Point at = function.draw(draw);
      const double got = function.calc(at);
      mpfr_set_d(x, at.x, MPFR_RNDN);
      mpfr_set_d(y, at.y, MPFR_RNDN);
      function.calc_exactly(exact, x, y);
      double ulps = 0.0;
      if (std::isfinite(got) && mpfr_number_p(exact) != 0) {
        const long exponent = mpfr_zero_p(exact) != 0 ? -2000 : mpfr_get_exp(exact);
        mpfr_sub_d(exact, exact, got, MPFR_RNDN);
        mpfr_mul_2si(exact, exact, 53 - std::max(exponent, -1021L), MPFR_RNDN);
        ulps = std::abs(mpfr_get_d(exact, MPFR_RNDN));
      } else if (got != mpfr_get_d(exact, MPFR_RNDN)) {
        ulps = std::numeric_limits<double>::infinity();
      }
      if (!(ulps <= greatest.ulps)) {
        greatest.ulps = ulps;
        greatest.x = at.x, greatest.y = at.y;
      }
    }
    errors.push_back(greatest);
  }
  mpfr_clears(x, y, exact, nullptr);
  return errors;
}

}  // namespace sls::test
