#include "recorder/sinks/csv/shortest_number.hpp"

#include <gtest/gtest.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <string>

namespace sls::record {
namespace {

double make_double(std::uint64_t sign, std::uint64_t biased_exponent, std::uint64_t fraction) {
  const std::uint64_t bits = sign << 63 | biased_exponent << 52 | fraction;
  double number = 0;
  std::memcpy(&number, &bits, sizeof number);
  return number;
}

/// Compares with the C++ library, and looks whether bytes outside the room are left alone.
void expect_text_of_library(double number) {
  constexpr char kUntouched = '#';
  std::array<char, kNumberRoom + 8> ours;
  ours.fill(kUntouched);
  const std::string text(ours.data(), write_shortest(number, ours.data()));
  std::array<char, 64> theirs;
  char* const end = std::to_chars(theirs.begin(), theirs.end(), number).ptr;
  ASSERT_EQ(text, std::string(theirs.data(), end));
  ASSERT_LE(text.size(), kLongestNumber);
  for (std::size_t i = kNumberRoom; i < ours.size(); ++i) ASSERT_EQ(ours[i], kUntouched) << text;
}

TEST(ShortestNumber, IsThatOfTheLibraryForAnyBits) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 300'000; ++i)
    ASSERT_NO_FATAL_FAILURE(
        expect_text_of_library(make_double(random() & 1, random() % 2048, random() >> 12)));
}

TEST(ShortestNumber, IsThatOfTheLibraryForSizesOfFlights) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 300'000; ++i)
    ASSERT_NO_FATAL_FAILURE(
        expect_text_of_library(make_double(random() & 1, 985 + random() % 80, random() >> 12)));
}

TEST(ShortestNumber, IsThatOfTheLibraryBesideEachPowerOfTwo) {
  for (std::uint64_t exponent = 0; exponent < 2048; ++exponent)
    for (std::uint64_t fraction = 0; fraction < 4; ++fraction) {
      ASSERT_NO_FATAL_FAILURE(expect_text_of_library(make_double(0, exponent, fraction)));
      const std::uint64_t last = (std::uint64_t{1} << 52) - 1 - fraction;
      ASSERT_NO_FATAL_FAILURE(expect_text_of_library(make_double(0, exponent, last)));
    }
}

TEST(ShortestNumber, IsThatOfTheLibraryForShortDecimalsOfEachPowerOfTen) {
  for (int power = -330; power <= 308; ++power)
    for (const char* digits : {"1", "2", "5", "9", "12", "99", "123", "1234567", "99999999",
                               "123456789", "9999999999999999", "12345678901234567"}) {
      const double number = std::strtod((digits + ("e" + std::to_string(power))).c_str(), nullptr);
      for (const double near : {number, std::nextafter(number, 0.0), std::nextafter(number, 1e308)})
        ASSERT_NO_FATAL_FAILURE(expect_text_of_library(-near));
    }
}

TEST(ShortestNumber, IsThatOfTheLibraryForIntegersAndTimes) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 100'000; ++i) {
    ASSERT_NO_FATAL_FAILURE(expect_text_of_library(static_cast<double>(i)));
    ASSERT_NO_FATAL_FAILURE(expect_text_of_library(static_cast<double>(i) / 1000));
    const std::uint64_t integer = random() >> (random() % 64);
    ASSERT_NO_FATAL_FAILURE(expect_text_of_library(static_cast<double>(integer)));
  }
}

TEST(ShortestNumber, IsAWordForWhatIsNotFinite) {
  for (const double number :
       {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    expect_text_of_library(number);
    expect_text_of_library(-number);
  }
}

}  // namespace
}  // namespace sls::record
