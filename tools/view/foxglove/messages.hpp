/// Makes and parses the messages of the Foxglove WebSocket protocol. No network here.
/// Source: https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "tools/view/web/connection.hpp"

namespace sls::view::foxglove {

/// A channel as it is advertised. Samples are CDR.
struct Channel {
  std::uint32_t id = 0;
  std::string topic;
  std::string schema_name;
  std::string schema_encoding;  ///< "omgidl" or "ros2msg"
  std::string schema;
};

enum class StatusLevel { kInfo = 0, kWarning = 1, kError = 2 };

/// Has the capability `time`; if `has_services`, also `services` with JSON.
Payload make_server_info(const std::string& session_id, bool has_services);
Payload make_status(StatusLevel level, const std::string& text);
Payload make_advertise(const std::vector<const Channel*>& channels);
Payload make_unadvertise(const std::vector<std::uint32_t>& channel_ids);
Payload make_service_call_failure(std::uint32_t service_id, std::uint32_t call_id,
                                  const std::string& text);

/// Binary: opcode 1. `time_ns`: simulation time of the current run, README.md.
Payload make_message_data(std::uint32_t subscription_id, std::int64_t time_ns,
                          const std::vector<std::uint8_t>& cdr);
/// Binary: opcode 2.
Payload make_time(std::int64_t time_ns);
/// Binary: opcode 3, JSON.
Payload make_service_call_response(std::uint32_t service_id, std::uint32_t call_id,
                                   const std::string& json);

struct Subscribe {
  struct Item {
    std::uint32_t subscription_id;
    std::uint32_t channel_id;
  };
  std::vector<Item> items;
};

struct Unsubscribe {
  std::vector<std::uint32_t> subscription_ids;
};

struct ServiceCall {
  std::uint32_t service_id = 0;
  std::uint32_t call_id = 0;
  std::string encoding;
  std::string data;
};

/// The defect of a message, as text.
struct Malformed {
  std::string text;
};

std::variant<Subscribe, Unsubscribe, Malformed> parse_text(std::string_view message);
std::variant<ServiceCall, Malformed> parse_binary(std::string_view message);

/// Printable start of what a client sent, for messages: at most 40 bytes, in quotation marks.
std::string quote(std::string_view text);

}  // namespace sls::view::foxglove
