#include "common/config/numbers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "common/config/scenario.hpp"

namespace sls::config {
namespace {

TEST(NumbersTest, ReadsWhatYamlCallsANumber) {
  EXPECT_EQ(parse_number("0.2"), 0.2);
  EXPECT_EQ(parse_number("-12"), -12.0);
  EXPECT_EQ(parse_number("+.5"), 0.5);
  EXPECT_EQ(parse_number("5."), 5.0);
  EXPECT_EQ(parse_number("1e-3"), 0.001);
  EXPECT_EQ(parse_number("1.5E+3"), 1500.0);
  EXPECT_TRUE(std::signbit(*parse_number("-0")));
}

TEST(NumbersTest, RefusesOtherTextsAsNumbers) {
  for (const char* text : {"", "-", "+", ".", "--1", "+-1", "1 2", "1,5", "0x10", "1_000", "one",
                           "nan(1)", "infinity", "1e", "e3", " 1", "1 ", "1.2.3", "true"})
    EXPECT_FALSE(parse_number(text)) << text;
}

TEST(NumbersTest, MarksNumbersThatADoubleCannotHold) {
  for (const char* text : {".nan", ".inf", "-.inf", "+.inf", "nan", "inf", "1e999", "-1e999"})
    EXPECT_FALSE(std::isfinite(parse_number(text).value())) << text;
}

TEST(NumbersTest, EveryDoubleReadsBackToTheSameBits) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t bits = random();
    double number = 0.0;
    std::memcpy(&number, &bits, sizeof number);
    if (!std::isfinite(number)) continue;
    EXPECT_EQ(parse_number(to_text(number)), number) << to_text(number);
  }
}

TEST(NumbersTest, WritesWithoutExponentInTheUsualRange) {
  EXPECT_EQ(to_text(0.0001), "0.0001");
  EXPECT_EQ(to_text(200.0), "200");
  EXPECT_EQ(to_text(-1e6), "-1000000");
  EXPECT_EQ(to_text(1e-7), "1.0e-07");
  EXPECT_EQ(to_text(1.5e-20), "1.5e-20");
}

TEST(NanosecondsTest, DecimalsAreExact) {
  EXPECT_EQ(to_nanoseconds(0.004), 4'000'000);
  EXPECT_EQ(to_nanoseconds(0.001), 1'000'000);
  EXPECT_EQ(to_nanoseconds(32.0), 32'000'000'000);
  EXPECT_EQ(to_nanoseconds(1e-9), 1);
  EXPECT_EQ(to_nanoseconds(-0.5), -500'000'000);
  EXPECT_EQ(to_nanoseconds(0.1 + 0.2), 300'000'000);
  EXPECT_EQ(to_nanoseconds(123456.789012345), 123'456'789'012'345);
  EXPECT_EQ(to_nanoseconds(1e6), 1'000'000'000'000'000);
}

TEST(NanosecondsTest, FractionsAndOverflowsAreRefused) {
  for (const double seconds :
       {1.0 / 3.0, 1.5e-9, 0.00400000001234, 1e7, -1e300, std::numeric_limits<double>::quiet_NaN(),
        std::numeric_limits<double>::infinity()})
    EXPECT_FALSE(to_nanoseconds(seconds)) << seconds;
}

TEST(NanosecondsTest, SecondsReadBackToTheSameNanosecond) {
  std::mt19937_64 random(2);
  std::uniform_int_distribution<std::int64_t> nanoseconds(0, 1'000'000'000'000'000);
  for (int i = 0; i < 20000; ++i) {
    const std::int64_t expected = nanoseconds(random) >> (i % 50);
    EXPECT_EQ(to_nanoseconds(to_seconds(expected)), expected);
  }
}

}  // namespace
}  // namespace sls::config
