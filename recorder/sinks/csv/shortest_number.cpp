#include "recorder/sinks/csv/shortest_number.hpp"

#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>

// Method: R. Giulietti, The Schubfach way to render doubles, 2020. A double is the nearest one to
// all numbers of an interval. Of the powers of ten that are not longer than the interval it takes
// the largest: the shortest text in the interval is a multiple of this one, or of ten times it.

namespace sls::record {
namespace {

__extension__ using Wide = unsigned __int128;

constexpr std::uint64_t get_high(Wide number) { return static_cast<std::uint64_t>(number >> 64); }
constexpr std::uint64_t get_low(Wide number) { return static_cast<std::uint64_t>(number); }

// --- Powers of ten -------------------------------------------------------------------------------

/// The first 128 bits of 10, 100 …, rounded up.
class PowersOfTen {
 public:
  struct Power {
    std::uint64_t high = 0, low = 0;
  };
  static constexpr int kMost = 324;  // for the smallest normal double

  PowersOfTen() {
    Limbs limbs;
    for (int exponent = 1; exponent <= kMost; ++exponent) {
      limbs.multiply_by_ten();
      const Wide first = limbs.take_first() + (exponent > kMostExact ? 1 : 0);
      powers_[static_cast<std::size_t>(exponent)] = {get_high(first), get_low(first)};
    }
  }

  const Power& operator[](int exponent) const {
    return powers_[static_cast<std::size_t>(exponent)];
  }

 private:
  static constexpr int kMostExact = 55;  // 5^55 has 128 bits

  /// A number of up to 1,152 bits; it begins as 1.
  class Limbs {
   public:
    void multiply_by_ten() {
      std::uint64_t carry = 0;
      for (std::size_t i = 0; i < used_; ++i) {
        carry += std::uint64_t{10} * limbs_[i];
        limbs_[i] = static_cast<std::uint32_t>(carry);
        carry >>= 32;
      }
      if (carry != 0) limbs_[used_++] = static_cast<std::uint32_t>(carry);
    }
    Wide take_first() const {
      Wide first = 0;
      for (std::size_t i = 1; i <= 4; ++i) first = first << 32 | get_from_top(i);
      const int zeros = __builtin_clzll(get_high(first));
      return first << zeros | get_from_top(5) >> (32 - zeros);
    }

   private:
    std::uint64_t get_from_top(std::size_t place) const {
      return place <= used_ ? limbs_[used_ - place] : 0;
    }
    std::array<std::uint32_t, 36> limbs_{1};  // the lowest first
    std::size_t used_ = 1;
  };

  std::array<Power, kMost + 1> powers_;
};

// --- Digits --------------------------------------------------------------------------------------

/// 0.d₁d₂…d₁₇ · 10^exponent; d₁ is not 0, and as many of the others as possible are.
struct Decimal {
  std::uint64_t digits = 0;  // d₁d₂…d₁₇
  int exponent = 0;          // of d₁
};

constexpr int kFractionBits = 52;
constexpr int kBias = 1075;  // of the exponent of the last bit

/// floor(log₁₀ 2^n), floor(log₁₀ (2^n · 3/4)) and floor(log₂ 10^n), exact for |n| ≤ 1,233.
constexpr int calc_log10(int n) { return n * 1262611 >> 22; }
constexpr int calc_log10_of_three_quarters(int n) { return (n * 1262611 - 524031) >> 22; }
constexpr int calc_log2_of_ten(int n) { return n * 1741647 >> 19; }

/// The product without its last 128 bits; its last bit is 1 if any of them is.
std::uint64_t multiply(const PowersOfTen::Power& power, std::uint64_t factor) {
  const Wide product = Wide{power.high} * factor + get_high(Wide{power.low} * factor);
  return get_high(product) | (get_low(product) > 1 ? 1 : 0);
}

/// Of a double below 2^52 in size that is normal, from its bits.
Decimal find_shortest(std::uint64_t fraction, int biased) {
  static const PowersOfTen powers;
  // The double is significand · 2^binary. Its neighbour below is half as near if it has another
  // exponent. All in quarters of 2^binary.
  const std::uint64_t significand = std::uint64_t{1} << kFractionBits | fraction;
  const int binary = biased - kBias;
  const bool is_lower_near = fraction == 0 && biased > 1;
  const int exponent = is_lower_near ? calc_log10_of_three_quarters(binary) : calc_log10(binary);
  const PowersOfTen::Power& power = powers[-exponent];
  const int shift = binary + calc_log2_of_ten(-exponent) + 1;
  const std::uint64_t value = multiply(power, (4 * significand) << shift);
  const std::uint64_t lower = multiply(power, (4 * significand - (is_lower_near ? 1 : 2)) << shift);
  const std::uint64_t upper = multiply(power, (4 * significand + 2) << shift);
  // A limit itself is read as this double only if that is even.
  const std::uint64_t odd = significand & 1;
  const auto is_above = [&](std::uint64_t units) { return lower + odd <= 4 * units; };
  const auto is_below = [&](std::uint64_t units) { return 4 * units + odd <= upper; };
  const std::uint64_t units = value / 4, tens = units / 10 * 10;
  const bool is_ten_inside = is_above(tens), is_next_ten_inside = is_below(tens + 10);
  std::uint64_t digits = 0;
  if (is_ten_inside != is_next_ten_inside) {
    digits = tens + (is_next_ten_inside ? 10 : 0);
  } else {
    const bool is_inside = is_above(units), is_next_inside = is_below(units + 1);
    const std::uint64_t middle = 4 * units + 2;
    const bool is_next_nearer = value > middle || (value == middle && units % 2 == 1);
    digits = units + ((is_inside != is_next_inside ? is_next_inside : is_next_nearer) ? 1 : 0);
  }
  constexpr std::uint64_t kSixteenDigits = 10'000'000'000'000'000;
  const bool is_short = digits < kSixteenDigits;
  return {digits * (is_short ? 10 : 1), exponent + (is_short ? 15 : 16)};
}

// --- Text ----------------------------------------------------------------------------------------

/// The digits of a number below 10^8, one a byte, the first in the lowest.
std::uint64_t spread_digits(std::uint64_t number) {
  std::uint64_t spread = number / 10'000 | number % 10'000 << 32;
  std::uint64_t tens = spread * 5'243 >> 19 & 0x0000'007f'0000'007f;
  spread = tens | (spread - 100 * tens) << 16;
  tens = spread * 103 >> 10 & 0x000f'000f'000f'000f;
  return tens | (spread - 10 * tens) << 8;
}

/// On little-endian processors, as all code of Fast DDS here.
void put(char* place, std::uint64_t digits) {
  digits |= 0x3030'3030'3030'3030;
  std::memcpy(place, &digits, sizeof digits);
}

}  // namespace

char* write_shortest(double number, char* text) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &number, sizeof bits);
  const auto biased = static_cast<int>(bits >> kFractionBits & 0x7ff);
  if (biased == 0 || biased >= kBias) {
    return std::to_chars(text, text + kNumberRoom, number).ptr;
  }
  *text = '-';
  text += bits >> 63;
  const Decimal decimal = find_shortest(bits & ((std::uint64_t{1} << kFractionBits) - 1), biased);
  constexpr std::uint64_t kEight = 100'000'000;
  const std::uint64_t front = decimal.digits / kEight;
  const auto first = static_cast<char>('0' + front / kEight);
  const std::uint64_t middle = spread_digits(front % kEight);
  const std::uint64_t last = spread_digits(decimal.digits % kEight);
  const int count = last != 0     ? 17 - __builtin_clzll(last) / 8
                    : middle != 0 ? 9 - __builtin_clzll(middle) / 8
                                  : 1;
  const int exponent = decimal.exponent;
  const auto write_digits = [&](char* place) {
    *place = first;
    put(place + 1, middle);
    put(place + 9, last);
  };
  const int single = count == 1 ? 1 : 0;
  if (exponent >= -4 + single && exponent - count + 1 <= 5 - single) {
    if (exponent < 0) {
      std::memcpy(text, "0.000000", 8);
      text += 1 - exponent;
      write_digits(text);
      return text + count;
    }
    write_digits(text);
    if (exponent + 1 >= count) return text + exponent + 1;
    char* const point = text + exponent + 1;
    std::array<char, 16> after;
    std::memcpy(after.data(), point, 16);
    *point = '.';
    std::memcpy(point + 1, after.data(), 16);
    return text + count + 1;
  }
  write_digits(text + 1);
  *text = first;
  if (count > 1) text[1] = '.';
  text += count > 1 ? count + 1 : 1;
  const int size = exponent < 0 ? -exponent : exponent;
  *text++ = 'e';
  *text++ = exponent < 0 ? '-' : '+';
  if (size >= 100) *text++ = static_cast<char>('0' + size / 100);
  *text++ = static_cast<char>('0' + size / 10 % 10);
  *text++ = static_cast<char>('0' + size % 10);
  return text;
}

}  // namespace sls::record
