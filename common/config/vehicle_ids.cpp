#include "common/config/vehicle_ids.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>

#include "common/config/yaml_node.hpp"

namespace sls::config {
namespace {

struct IdRange {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
};

std::optional<std::uint32_t> parse_id(std::string_view text) {
  std::uint32_t id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return id;
}

/// `7` or `0-9`.
std::optional<IdRange> parse_range(std::string_view text) {
  const auto dash = text.find('-');
  const auto first = parse_id(text.substr(0, dash));
  const auto last = dash == text.npos ? first : parse_id(text.substr(dash + 1));
  if (!first || !last || *last < *first) return std::nullopt;
  return IdRange{*first, *last};
}

}  // namespace

std::vector<std::uint32_t> parse_vehicle_ids(const std::string& text, std::size_t fleet_size) {
  const auto fail = [&](const std::string& expected, std::string_view got) {
    throw ConfigError("--vehicles: expected " + expected + ", got '" +
                      to_printable(std::string(got)) + "'");
  };
  std::vector<bool> is_named(fleet_size, text == "all");
  for (std::string_view rest = text; text != "all";) {
    const auto comma = rest.find(',');
    const std::string_view word = rest.substr(0, comma);
    const auto range = parse_range(word);
    if (!range) fail("all, or ids and ranges such as 0-9,20", word);
    if (range->last >= fleet_size)
      fail(fleet_size == 1 ? "0, the scenario's only vehicle"
                           : "vehicles from 0 to " + std::to_string(fleet_size - 1),
           word);
    std::fill(is_named.begin() + range->first, is_named.begin() + range->last + 1, true);
    if (comma == rest.npos) break;
    rest.remove_prefix(comma + 1);
  }
  std::vector<std::uint32_t> ids;
  for (std::size_t id = 0; id < fleet_size; ++id)
    if (is_named[id]) ids.push_back(static_cast<std::uint32_t>(id));
  return ids;
}

std::string to_vehicle_ranges(const std::vector<std::uint32_t>& ids) {
  std::string text;
  for (std::size_t i = 0; i < ids.size();) {
    std::size_t last = i;
    while (last + 1 < ids.size() && ids[last + 1] == ids[last] + 1) ++last;
    text += (text.empty() ? "" : ",") + std::to_string(ids[i]);
    if (last > i) text += "-" + std::to_string(ids[last]);
    i = last + 1;
  }
  return text;
}

}  // namespace sls::config
