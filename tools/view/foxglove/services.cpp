#include "tools/view/foxglove/services.hpp"

#include <array>
#include <nlohmann/json.hpp>

#include "tools/view/live/client_json.hpp"

namespace sls::view::foxglove {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<Service, 6> kServices = {{{1, "/sls/start", ControlAction::ACTION_START},
                                               {2, "/sls/pause", ControlAction::ACTION_PAUSE},
                                               {3, "/sls/step", ControlAction::ACTION_STEP},
                                               {4, "/sls/resume", ControlAction::ACTION_RESUME},
                                               {5, "/sls/reset", ControlAction::ACTION_RESET},
                                               {6, "/sls/stop", ControlAction::ACTION_STOP}}};

Json make_part(const std::string& schema_name, const Json& properties) {
  const Json schema = {{"title", schema_name}, {"type", "object"}, {"properties", properties}};
  return {{"encoding", "json"},
          {"schemaName", schema_name},
          {"schemaEncoding", "jsonschema"},
          {"schema", dump(schema)}};
}

Json make_service(const Service& service) {
  const std::string type = std::string("sls/") + (service.name + sizeof("/sls/") - 1);
  Json request = Json::object();
  if (service.action == ControlAction::ACTION_STEP)
    request["steps"] = {{"type", "integer"}, {"minimum", 1}, {"default", 1}};
  const Json response = {{"accepted", {{"type", "boolean"}}},
                         {"reason", {{"type", "string"}}},
                         {"step", {{"type", "integer"}}}};
  return {{"id", service.id},
          {"name", service.name},
          {"type", type},
          {"request", make_part(type + "_Request", request)},
          {"response", make_part(type + "_Response", response)}};
}

}  // namespace

const Service* find_service(std::uint32_t id) {
  for (const Service& service : kServices)
    if (service.id == id) return &service;
  return nullptr;
}

Payload make_advertise_services() {
  Json services = Json::array();
  for (const Service& service : kServices) services.push_back(make_service(service));
  return to_payload({{"op", "advertiseServices"}, {"services", std::move(services)}});
}

std::variant<std::uint64_t, Malformed> parse_request(const Service& service,
                                                     const std::string& text) {
  const bool has_steps = service.action == ControlAction::ACTION_STEP;
  const auto json = text.empty() ? nlohmann::json::object() : parse_client_json(text);
  if (!json.is_object())
    return Malformed{std::string(service.name) + ": expected a JSON object, got " + quote(text)};
  std::uint64_t steps = has_steps ? 1 : 0;
  for (const auto& [key, value] : json.items()) {
    if (key != "steps" || !has_steps)
      return Malformed{std::string(service.name) + ": unknown key " + quote(key)};
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() == 0)
      return Malformed{std::string(service.name) + ": steps: expected a whole number ≥ 1, got " +
                       quote(value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace))};
    steps = value.get<std::uint64_t>();
  }
  return steps;
}

std::string make_response(const OperatorReply& reply) {
  return dump({{"accepted", reply.is_accepted}, {"reason", reply.reason}, {"step", reply.step}});
}

}  // namespace sls::view::foxglove
