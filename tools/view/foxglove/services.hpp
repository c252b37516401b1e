/// The services of operators: /sls/pause, /sls/step, … with JSON requests.
#pragma once

#include <cstdint>
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

/// Steps of a request, or its defect. 0 for services other than /sls/step, which has 1 by default.
std::variant<std::uint64_t, Malformed> parse_request(const Service& service,
                                                     const std::string& json);

/// {"accepted":true,"reason":"","step":12}
std::string make_response(const OperatorReply& reply);

}  // namespace sls::view::foxglove
