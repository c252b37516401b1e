#pragma once

#include <cstddef>
#include <string>

namespace sls::config {

/// Insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`.
std::size_t calc_edit_distance(const std::string& a, const std::string& b);

}  // namespace sls::config
