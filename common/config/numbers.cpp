#include "common/config/numbers.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "common/config/scenario.hpp"

namespace sls::config {
namespace {

constexpr double kNanosecondsPerSecond = 1e9;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool is_non_finite_word(std::string_view word) {
  for (const char* known : {".inf", ".Inf", ".INF", ".nan", ".NaN", ".NAN", "inf", "nan", "NaN"})
    if (word == known) return true;
  return false;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  const bool negative = !text.empty() && text.front() == '-';
  if (negative || (!text.empty() && text.front() == '+')) text.remove_prefix(1);
  if (is_non_finite_word(text)) return std::numeric_limits<double>::infinity();
  // from_chars alone would also take a second sign and words such as "nan(x)".
  const bool starts_like_a_number =
      !text.empty() &&
      (is_digit(text[0]) || (text[0] == '.' && text.size() > 1 && is_digit(text[1])));
  if (!starts_like_a_number) return std::nullopt;

  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (end != text.data() + text.size()) return std::nullopt;
  if (error == std::errc::result_out_of_range) return std::numeric_limits<double>::infinity();
  if (error != std::errc()) return std::nullopt;
  return negative ? -number : number;
}

std::string to_text(double number) {
  std::array<char, 64> buffer;
  const double magnitude = std::abs(number);
  const bool fixed = magnitude == 0.0 || (magnitude >= 1e-6 && magnitude < 1e15);
  const auto format = fixed ? std::chars_format::fixed : std::chars_format::scientific;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number, format);
  std::string text(buffer.data(), result.ptr);
  // YAML 1.1 readers (Python's among them) take 1e-07 for text and 1.0e-07 for a number.
  if (const auto e = text.find('e'); e != std::string::npos && text.find('.') == std::string::npos)
    text.insert(e, ".0");
  return text;
}

double to_seconds(std::int64_t nanoseconds) {
  return static_cast<double>(nanoseconds) / kNanosecondsPerSecond;
}

std::optional<std::int64_t> to_nanoseconds(double seconds) {
  const double exact = seconds * kNanosecondsPerSecond;
  if (!(std::abs(seconds) <= kMaxSeconds)) return std::nullopt;
  const double nearest = std::round(exact);
  // For long times the spacing of doubles exceeds the tolerance. There `seconds` must be the double
  // nearest to a whole number of nanoseconds.
  if (std::abs(exact - nearest) > 1e-3 && nearest / kNanosecondsPerSecond != seconds)
    return std::nullopt;
  return static_cast<std::int64_t>(nearest);
}

}  // namespace sls::config
