#include "tools/view/foxglove/session.hpp"

#include <spdlog/fmt/fmt.h>

#include "tools/view/foxglove/services.hpp"

namespace sls::view::foxglove {

namespace {
constexpr std::uint16_t kPolicyViolation = 1008;
constexpr std::size_t kMostForgotten = 4096;
}  // namespace

FoxgloveSession::FoxgloveSession(std::shared_ptr<Hub> hub, Connection& connection)
    : hub_(std::move(hub)), connection_(connection) {
  hub_->add(*this);
  if (may_call()) send_text(make_advertise_services());
}

FoxgloveSession::~FoxgloveSession() { hub_->remove(*this); }

bool FoxgloveSession::may_call() const {
  return connection_.may_operate() && hub_->requests().may_ask();
}

void FoxgloveSession::forget(std::uint32_t subscription_id) {
  if (forgotten_.size() < kMostForgotten) forgotten_.insert(subscription_id);
}

void FoxgloveSession::receive(MessageKind kind, std::string_view message) {
  if (errors_ > kMostErrors) return;  // the connection is being closed
  kind == MessageKind::kText ? receive_text(message) : receive_binary(message);
}

void FoxgloveSession::receive_text(std::string_view message) {
  const auto parsed = parse_text(message);
  if (const auto* malformed = std::get_if<Malformed>(&parsed)) note_error(malformed->text);
  if (const auto* subscribe = std::get_if<Subscribe>(&parsed))
    for (const Subscribe::Item& item : subscribe->items) {
      if (errors_ > kMostErrors) return;
      forgotten_.erase(item.subscription_id);
      if (const auto error = hub_->subscribe(*this, item)) note_error(*error);
    }
  if (const auto* ended = std::get_if<Unsubscribe>(&parsed))
    for (const std::uint32_t id : ended->subscription_ids) unsubscribe(id);
}

void FoxgloveSession::unsubscribe(std::uint32_t subscription_id) {
  if (errors_ > kMostErrors || forgotten_.erase(subscription_id) > 0) return;
  if (!hub_->unsubscribe(*this, subscription_id))
    note_error(fmt::format("unsubscribe: there is no subscription {}", subscription_id));
}

void FoxgloveSession::receive_binary(std::string_view message) {
  const auto parsed = parse_binary(message);
  if (const auto* malformed = std::get_if<Malformed>(&parsed)) return note_error(malformed->text);
  call(std::get<ServiceCall>(parsed));
}

void FoxgloveSession::call(const ServiceCall& call) {
  const auto refuse = [&](const std::string& text) {
    fail(call, text);
    note_error(text);
  };
  const Service* service = find_service(call.service_id);
  if (!service) return refuse(fmt::format("there is no service {}", call.service_id));
  if (!connection_.may_operate())
    return refuse(fmt::format("{}: not allowed: {}", service->name, connection_.why_not()));
  if (!hub_->requests().may_ask())
    return refuse(fmt::format("{}: not allowed: the keys of this viewer are not an operator's",
                              service->name));
  if (call.encoding != "json")
    return refuse(
        fmt::format("{}: encoding: expected json, got {}", service->name, quote(call.encoding)));
  const auto steps = parse_request(*service, call.data);
  if (const auto* malformed = std::get_if<Malformed>(&steps)) return refuse(malformed->text);
  hub_->requests().request(service->action, std::get<std::uint64_t>(steps),
                           [session = std::weak_ptr<FoxgloveSession*>(self_), service,
                            id = call.call_id](const OperatorReply& reply) {
                             const auto alive = session.lock();
                             if (alive) (*alive)->answer(*service, id, reply);
                           });
}

void FoxgloveSession::answer(const Service& service, std::uint32_t call_id,
                             const OperatorReply& reply) {
  if (reply.is_accepted) {
    connection_.send(MessageKind::kBinary,
                     make_service_call_response(service.id, call_id, make_response(reply)),
                     Delivery::kAlways);
    return;
  }
  const std::string text = fmt::format("{} refused: {}", service.name, reply.reason);
  send_text(make_service_call_failure(service.id, call_id, text));
  send_text(make_status(StatusLevel::kWarning, text));  // Lichtblick shows no failures of services
}

void FoxgloveSession::fail(const ServiceCall& call, const std::string& text) {
  send_text(make_service_call_failure(call.service_id, call.call_id, text));
}

void FoxgloveSession::note_error(const std::string& text) {
  send_text(make_status(StatusLevel::kError, text));
  if (++errors_ > kMostErrors)
    connection_.close(kPolicyViolation, fmt::format("more than {} errors", kMostErrors));
}

void FoxgloveSession::send_text(Payload text) {
  connection_.send(MessageKind::kText, std::move(text), Delivery::kAlways);
}

}  // namespace sls::view::foxglove

namespace sls::view {

Protocol make_foxglove_protocol(Feed& feed, Operator& requests) {
  const auto hub = std::make_shared<foxglove::Hub>(feed, requests);
  return {{"foxglove.sdk.v1", "foxglove.websocket.v1"}, [hub](Connection& connection) {
            return std::make_unique<foxglove::FoxgloveSession>(hub, connection);
          }};
}

}  // namespace sls::view
