/// JSON from a client, at a cost that grows with its length only, and to one.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "tools/view/web/connection.hpp"

namespace sls::view {

/// Most keys of an object in a client's message.
inline constexpr int kMostKeys = 16;

/// The parsed message; discarded if it is no JSON, or an object has more than kMostKeys. Plain
/// objects: for each new key an ordered one compares all others.
inline nlohmann::json parse_client_json(std::string_view text) {
  using Event = nlohmann::json::parse_event_t;
  std::vector<int> keys;  // of the open objects, by depth
  bool has_too_many = false;
  const auto judge = [&](int depth, Event event, const nlohmann::json&) {
    const auto at = static_cast<std::size_t>(depth);
    if (event == Event::object_start) keys.resize(at + 2), keys[at + 1] = 0;
    if (event == Event::key && ++keys[at] > kMostKeys) has_too_many = true;
    return !has_too_many;
  };
  nlohmann::json parsed = nlohmann::json::parse(text, judge, false);
  return has_too_many ? nlohmann::json(nlohmann::json::value_t::discarded) : parsed;
}

/// Replaces bytes that are not UTF-8: texts come from the network.
inline std::string dump(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}
inline Payload to_payload(const nlohmann::ordered_json& json) {
  return std::make_shared<const std::string>(dump(json));
}

}  // namespace sls::view
