/// Numbers as text, the same in every locale, and times in whole nanoseconds.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace sls::config {

/// Longest time a scenario can hold, s: nanoseconds stay exact in a double and far from overflow.
inline constexpr double kMaxSeconds = 1e6;
inline constexpr std::int64_t kMaxNanoseconds = 1'000'000'000'000'000;

/// The number that `text` holds as a YAML scalar (1, -2.5, 1e-3, .inf, .nan), or nothing if it is
/// none. A number too large for a double becomes an infinity.
std::optional<double> parse_number(std::string_view text);

/// Shortest decimal that reads back to the same double, without exponent in the usual range.
std::string to_text(double number);

/// `nanoseconds` as seconds; `to_nanoseconds` gives it back exactly up to `kMaxSeconds`.
double to_seconds(std::int64_t nanoseconds);

}  // namespace sls::config
