/// The services of operators: /sls/pause, /sls/step, … with JSON requests.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "tools/view/foxglove/messages.hpp"
#include "tools/view/live/operator.hpp"

namespace sls::view::foxglove {

struct Service {
  std::uint32_t id;
  const char* name;
  ControlAction action;
};

const Service* find_service(std::uint32_t id);

/// The message `advertiseServices`.
Payload make_advertise_services();

/// Steps of a request (0 of all but /sls/step, there 1 if it names none), or what is wrong.
std::variant<std::uint64_t, Malformed> parse_request(const Service& service,
                                                     const std::string& json);

/// {"accepted":true,"reason":"","step":12}
std::string make_response(const OperatorReply& reply);

}  // namespace sls::view::foxglove
