#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace sls::text {

/// Insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`.
std::size_t calc_edit_distance(const std::string& a, const std::string& b);

/// A suggestion for an unknown `key`: a typing error or a forgotten unit.
std::optional<std::string> find_similar(const std::string& key,
                                        const std::vector<std::string>& known);

}  // namespace sls::text
