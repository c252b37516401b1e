/// Texts of files and of the network, as a terminal may get them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace sls::text {

/// Length of the well-formed UTF-8 sequence at `at`, or 0. Source: Unicode 15, table 3-7.
std::size_t calc_utf8_length(std::string_view text, std::size_t at);

/// Length of the printable character at `at`, or 0: of a control (C0, DEL, C1), a line or paragraph
/// separator, a change of direction, and a byte that is not UTF-8.
std::size_t calc_printable_length(std::string_view text, std::size_t at);

/// `text` in one line that cannot control a terminal: each byte of what is not printable becomes
/// `\xNN`.
std::string escape_controls(std::string_view text);

}  // namespace sls::text
