#include "common/model/math.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/oracle/math_errors.hpp"

namespace sls::math {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kTiny = std::numeric_limits<double>::denorm_min();
constexpr double kMax = std::numeric_limits<double>::max();
constexpr double kPi = 3.14159265358979323846;

/// Equal, and so are the signs of zeros.
::testing::AssertionResult is_same(double got, double expected) {
  if (got == expected && std::signbit(got) == std::signbit(expected))
    return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "got " << got << ", expected " << expected;
}

TEST(MathTest, ErrorsAgainstMpfrAreBelowTheirBounds) {
  for (const test::GreatestError& error : test::find_greatest_errors(100'000, 7)) {
    const bool is_by_identity = error.function == "tan" || error.function == "asin" ||
                                error.function == "hypot" || error.function == "expm1";
    EXPECT_LE(error.ulps, is_by_identity ? 3.0 : 1.0)
        << error.function << " at x = " << error.x << ", y = " << error.y;
  }
}

TEST(MathTest, SineAndCosineOfSpecialArgumentsAreThoseOfC99) {
  EXPECT_TRUE(is_same(sin(0.0), 0.0));
  EXPECT_TRUE(is_same(sin(-0.0), -0.0));
  EXPECT_TRUE(is_same(sin(kTiny), kTiny));
  EXPECT_TRUE(is_same(sin(-1e-310), -1e-310));
  EXPECT_TRUE(is_same(cos(0.0), 1.0));
  EXPECT_TRUE(is_same(cos(-0.0), 1.0));
  for (const double x : {kInfinity, -kInfinity, kNan}) {
    EXPECT_TRUE(std::isnan(sin(x)));
    EXPECT_TRUE(std::isnan(cos(x)));
    EXPECT_TRUE(std::isnan(sincos(x).sine));
    EXPECT_TRUE(std::isnan(sincos(x).cosine));
    EXPECT_TRUE(std::isnan(tan(x)));
  }
  EXPECT_TRUE(is_same(tan(-0.0), -0.0));
}

// From J.-M. Muller, Elementary Functions: the double closest to a multiple of π/2.
TEST(MathTest, TheHardestArgumentIsReducedRight) {
  const double x = 6381956970095103.0 * 0x1p797;
  EXPECT_NEAR(cos(x), -4.68716592425462761112e-19, 1e-34);
  EXPECT_EQ(std::abs(sin(x)), 1.0);
  EXPECT_LE(std::abs(sin(kMax)), 1.0);
  EXPECT_NEAR(std::pow(sin(kMax), 2) + std::pow(cos(kMax), 2), 1.0, 4e-16);
}

TEST(MathTest, SincosIsSineAndCosine) {
  for (double x = 1e-9; x < 1e300; x *= 1.37)
    for (const double signed_x : {x, -x}) {
      EXPECT_TRUE(is_same(sincos(signed_x).sine, sin(signed_x)));
      EXPECT_TRUE(is_same(sincos(signed_x).cosine, cos(signed_x)));
    }
}

TEST(MathTest, FunctionsAreOddOrEven) {
  for (double x = 1e-9; x < 1e300; x *= 1.39) {
    EXPECT_TRUE(is_same(sin(-x), -sin(x)));
    EXPECT_TRUE(is_same(cos(-x), cos(x)));
    EXPECT_TRUE(is_same(atan2(-x, 2.0), -atan2(x, 2.0)));
  }
}

TEST(MathTest, ExponentialOfSpecialArgumentsIsThatOfC99) {
  EXPECT_TRUE(is_same(exp(0.0), 1.0));
  EXPECT_TRUE(is_same(exp(-0.0), 1.0));
  EXPECT_TRUE(is_same(exp(kInfinity), kInfinity));
  EXPECT_TRUE(is_same(exp(-kInfinity), 0.0));
  EXPECT_TRUE(std::isnan(exp(kNan)));
  EXPECT_TRUE(is_same(exp(kTiny), 1.0));
  EXPECT_TRUE(is_same(exp(710.0), kInfinity));
  EXPECT_TRUE(is_same(exp(kMax), kInfinity));
  EXPECT_TRUE(is_same(exp(-745.1), kTiny));
  EXPECT_TRUE(is_same(exp(-746.0), 0.0));
  EXPECT_TRUE(is_same(exp(-kMax), 0.0));
  EXPECT_TRUE(is_same(expm1(-0.0), -0.0));
  EXPECT_TRUE(is_same(expm1(kTiny), kTiny));
  EXPECT_TRUE(is_same(expm1(-kInfinity), -1.0));
  EXPECT_TRUE(is_same(expm1(kInfinity), kInfinity));
  EXPECT_TRUE(std::isnan(expm1(kNan)));
}

TEST(MathTest, LogarithmOfSpecialArgumentsIsThatOfC99) {
  EXPECT_TRUE(is_same(log(1.0), 0.0));
  EXPECT_TRUE(is_same(log(0.0), -kInfinity));
  EXPECT_TRUE(is_same(log(-0.0), -kInfinity));
  EXPECT_TRUE(is_same(log(kInfinity), kInfinity));
  for (const double x : {-1.0, -kInfinity, -kTiny, kNan}) EXPECT_TRUE(std::isnan(log(x)));
  EXPECT_TRUE(is_same(log(2.0), 0.69314718055994530942));
  EXPECT_TRUE(is_same(log(kTiny), -744.44007192138126231));
}

// C99, F.9.1.4.
TEST(MathTest, ArcTangentOfSpecialArgumentsIsThatOfC99) {
  for (const double sign : {1.0, -1.0}) {
    EXPECT_TRUE(is_same(atan2(sign * 0.0, -0.0), sign * kPi));
    EXPECT_TRUE(is_same(atan2(sign * 0.0, 0.0), sign * 0.0));
    EXPECT_TRUE(is_same(atan2(sign * 0.0, -2.0), sign * kPi));
    EXPECT_TRUE(is_same(atan2(sign * 0.0, 2.0), sign * 0.0));
    EXPECT_TRUE(is_same(atan2(sign * 2.0, 0.0), sign * kPi / 2));
    EXPECT_TRUE(is_same(atan2(sign * 2.0, -0.0), sign * kPi / 2));
    EXPECT_TRUE(is_same(atan2(sign * 2.0, -kInfinity), sign * kPi));
    EXPECT_TRUE(is_same(atan2(sign * 2.0, kInfinity), sign * 0.0));
    EXPECT_TRUE(is_same(atan2(sign * kInfinity, 2.0), sign * kPi / 2));
    EXPECT_TRUE(is_same(atan2(sign * kInfinity, -kInfinity), sign * 3 * kPi / 4));
    EXPECT_TRUE(is_same(atan2(sign * kInfinity, kInfinity), sign * kPi / 4));
    EXPECT_TRUE(is_same(atan2(sign * kTiny, kMax), sign * 0.0));
    EXPECT_TRUE(is_same(atan2(sign * kTiny, kTiny), sign * kPi / 4));
    EXPECT_TRUE(is_same(atan2(sign * kMax, kMax), sign * kPi / 4));
  }
  EXPECT_TRUE(std::isnan(atan2(kNan, 1.0)));
  EXPECT_TRUE(std::isnan(atan2(1.0, kNan)));
}

TEST(MathTest, LengthOfSpecialArgumentsIsThatOfC99) {
  EXPECT_TRUE(is_same(hypot(-0.0, -0.0), 0.0));
  EXPECT_TRUE(is_same(hypot(kInfinity, kNan), kInfinity));
  EXPECT_TRUE(is_same(hypot(kNan, -kInfinity), kInfinity));
  EXPECT_TRUE(std::isnan(hypot(kNan, 1.0)));
  EXPECT_TRUE(is_same(hypot(3e300, -4e300), 5e300));
  EXPECT_TRUE(is_same(hypot(kTiny, 0.0), kTiny));
}

TEST(MathTest, ArcSineOfSpecialArgumentsIsThatOfC99) {
  EXPECT_TRUE(is_same(asin(-0.0), -0.0));
  EXPECT_TRUE(is_same(asin(1.0), kPi / 2));
  EXPECT_TRUE(is_same(asin(-1.0), -kPi / 2));
  EXPECT_TRUE(std::isnan(asin(1.5)));
}

}  // namespace
}  // namespace sls::math
