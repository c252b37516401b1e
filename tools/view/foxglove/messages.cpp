#include "tools/view/foxglove/messages.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "tools/view/live/client_json.hpp"

namespace sls::view::foxglove {

namespace {

using Json = nlohmann::ordered_json;  // sent
using Message = nlohmann::json;       // received

constexpr char kMessageData = 1, kTime = 2, kServiceCallResponse = 3;  // from the server
constexpr char kClientMessageData = 1, kServiceCallRequest = 2;        // from a client
constexpr const char* kJson = "json";

template <class Number>
void append(std::string& bytes, Number number) {
  for (std::size_t i = 0; i < sizeof number; ++i)
    bytes.push_back(static_cast<char>(static_cast<std::uint64_t>(number) >> (8 * i) & 0xff));
}

std::uint32_t read_u32(std::string_view bytes, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i)
    number |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
  return number;
}

std::uint64_t to_time(std::int64_t time_ns) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(time_ns, 0));
}

std::optional<std::uint32_t> find_id(const Message& value) {
  if (!value.is_number_unsigned()) return std::nullopt;
  const auto number = value.get<std::uint64_t>();
  if (number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

std::optional<std::uint32_t> find_id(const Message& object, const char* key) {
  if (!object.is_object()) return std::nullopt;
  const auto found = object.find(key);
  return found == object.end() ? std::nullopt : find_id(*found);
}

const Message* find_array(const Message& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_array() ? &*found : nullptr;
}

std::variant<Subscribe, Unsubscribe, Malformed> parse_subscribe(const Message& json) {
  const Message* array = find_array(json, "subscriptions");
  if (!array) return Malformed{"subscribe: subscriptions: expected an array"};
  Subscribe subscribe;
  for (const Message& item : *array) {
    const auto id = find_id(item, "id"), channel_id = find_id(item, "channelId");
    if (!id || !channel_id)
      return Malformed{
          "subscribe: subscriptions: expected objects with the whole numbers id and channelId"};
    subscribe.items.push_back({*id, *channel_id});
  }
  return subscribe;
}

std::variant<Subscribe, Unsubscribe, Malformed> parse_unsubscribe(const Message& json) {
  const Message* array = find_array(json, "subscriptionIds");
  if (!array) return Malformed{"unsubscribe: subscriptionIds: expected an array"};
  Unsubscribe unsubscribe;
  for (const Message& item : *array) {
    const auto id = find_id(item);
    if (!id) return Malformed{"unsubscribe: subscriptionIds: expected whole numbers"};
    unsubscribe.subscription_ids.push_back(*id);
  }
  return unsubscribe;
}

/// The capability that operation `op` of the protocol requires and this server lacks; null for any
/// other word.
const char* find_missing_capability(std::string_view op) {
  static constexpr std::pair<std::string_view, const char*> kMissing[] = {
      {"advertise", "clientPublish"},
      {"unadvertise", "clientPublish"},
      {"getParameters", "parameters"},
      {"setParameters", "parameters"},
      {"subscribeParameterUpdates", "parametersSubscribe"},
      {"unsubscribeParameterUpdates", "parametersSubscribe"},
      {"subscribeConnectionGraph", "connectionGraph"},
      {"unsubscribeConnectionGraph", "connectionGraph"},
      {"fetchAsset", "assets"}};
  for (const auto& [name, capability] : kMissing)
    if (name == op) return capability;
  return nullptr;
}

Malformed refuse(const std::string& op) {
  if (const char* capability = find_missing_capability(op))
    return Malformed{op + ": this server does not have the capability " + capability};
  return Malformed{"op: expected subscribe or unsubscribe, got " + quote(op)};
}

}  // namespace

std::string quote(std::string_view text) {
  constexpr std::size_t kMost = 40;
  std::string quoted = "'";
  for (const char letter : text.substr(0, kMost))
    quoted += letter >= ' ' && letter <= '~' ? letter : '?';
  return quoted + (text.size() > kMost ? "…'" : "'");
}

Payload make_server_info(const std::string& session_id, bool has_services) {
  Json json = {{"op", "serverInfo"}, {"name", "sls_view"}, {"capabilities", {"time"}}};
  if (has_services) {
    json["capabilities"].push_back("services");
    json["supportedEncodings"] = {kJson};
  }
  json["sessionId"] = session_id;
  return to_payload(json);
}

Payload make_status(StatusLevel level, const std::string& text) {
  return to_payload({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", text}});
}

Payload make_advertise(const std::vector<const Channel*>& channels) {
  Json array = Json::array();
  for (const Channel* channel : channels)
    array.push_back({{"id", channel->id},
                     {"topic", channel->topic},
                     {"encoding", "cdr"},
                     {"schemaName", channel->schema_name},
                     {"schema", channel->schema},
                     {"schemaEncoding", channel->schema_encoding}});
  return to_payload({{"op", "advertise"}, {"channels", std::move(array)}});
}

Payload make_unadvertise(const std::vector<std::uint32_t>& channel_ids) {
  return to_payload({{"op", "unadvertise"}, {"channelIds", channel_ids}});
}

Payload make_service_call_failure(std::uint32_t service_id, std::uint32_t call_id,
                                  const std::string& text) {
  return to_payload({{"op", "serviceCallFailure"},
                     {"serviceId", service_id},
                     {"callId", call_id},
                     {"message", text}});
}

Payload make_message_data(std::uint32_t subscription_id, std::int64_t time_ns,
                          const std::vector<std::uint8_t>& cdr) {
  constexpr std::size_t kHeader = 13;
  std::string bytes;
  bytes.reserve(kHeader + cdr.size());
  bytes.push_back(kMessageData);
  append(bytes, subscription_id);
  append(bytes, to_time(time_ns));
  bytes.append(reinterpret_cast<const char*>(cdr.data()), cdr.size());
  return std::make_shared<const std::string>(std::move(bytes));
}

Payload make_time(std::int64_t time_ns) {
  std::string bytes(1, kTime);
  append(bytes, to_time(time_ns));
  return std::make_shared<const std::string>(std::move(bytes));
}

Payload make_service_call_response(std::uint32_t service_id, std::uint32_t call_id,
                                   const std::string& json) {
  const std::string encoding = kJson;
  std::string bytes(1, kServiceCallResponse);
  append(bytes, service_id);
  append(bytes, call_id);
  append(bytes, static_cast<std::uint32_t>(encoding.size()));
  return std::make_shared<const std::string>(bytes + encoding + json);
}

std::variant<Subscribe, Unsubscribe, Malformed> parse_text(std::string_view message) {
  const Message json = parse_client_json(message);
  if (json.is_discarded())
    return Malformed{"expected JSON, at most 16 keys an object, got " + quote(message)};
  const auto op = json.is_object() ? json.find("op") : json.end();
  if (!json.is_object() || op == json.end() || !op->is_string())
    return Malformed{"expected a JSON object with the text op, got " + quote(message)};
  if (*op == "subscribe") return parse_subscribe(json);
  if (*op == "unsubscribe") return parse_unsubscribe(json);
  return refuse(op->get<std::string>());
}

std::variant<ServiceCall, Malformed> parse_binary(std::string_view message) {
  constexpr std::size_t kHeader = 13;
  if (message.empty()) return Malformed{"binary message: expected an opcode, got no byte"};
  if (message[0] == kClientMessageData)
    return Malformed{"binary message: this server does not have the capability clientPublish"};
  if (message[0] != kServiceCallRequest)
    return Malformed{"binary message: expected opcode 2 (service call request), got " +
                     std::to_string(static_cast<unsigned char>(message[0]))};
  const std::size_t length = message.size() < kHeader ? 0 : read_u32(message, 9);
  if (message.size() < kHeader || length > message.size() - kHeader)
    return Malformed{"service call: expected service id, call id and an encoding, got " +
                     std::to_string(message.size()) + " bytes"};
  ServiceCall call;
  call.service_id = read_u32(message, 1);
  call.call_id = read_u32(message, 5);
  call.encoding = message.substr(kHeader, length);
  call.data = message.substr(kHeader + length);
  return call;
}

}  // namespace sls::view::foxglove
