#include "common/text/printable.hpp"

namespace sls::text {

std::size_t calc_utf8_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) {
    return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0u;
  };
  const auto continues = [&](std::size_t i) { return (byte(i) & 0xC0u) == 0x80u; };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return continues(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    const bool overlong = first == 0xE0 && byte(1) < 0xA0;
    const bool surrogate = first == 0xED && byte(1) > 0x9F;
    return continues(1) && continues(2) && !overlong && !surrogate ? 3 : 0;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    const bool overlong = first == 0xF0 && byte(1) < 0x90;
    const bool beyond = first == 0xF4 && byte(1) > 0x8F;
    return continues(1) && continues(2) && continues(3) && !overlong && !beyond ? 4 : 0;
  }
  return 0;
}

std::size_t calc_printable_length(std::string_view text, std::size_t at) {
  const std::size_t length = calc_utf8_length(text, at);
  const std::string_view letter = text.substr(at, length);
  const bool is_control = length == 1 && (letter < " " || letter == "\x7F");
  const bool is_c1 = length == 2 && letter < "\xC2\xA0";
  const bool is_separator = letter >= "\u2028" && letter <= "\u202E" && length == 3;
  const bool is_isolate = letter >= "\u2066" && letter <= "\u2069" && length == 3;
  return is_control || is_c1 || is_separator || is_isolate ? 0 : length;
}

std::string escape_controls(std::string_view text) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string printable;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = calc_printable_length(text, at);
    const auto byte = static_cast<unsigned char>(text[at]);
    if (length > 0)
      printable += text.substr(at, length);
    else
      printable += {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 15]};
    at += length > 0 ? length : 1;
  }
  return printable;
}

}  // namespace sls::text
