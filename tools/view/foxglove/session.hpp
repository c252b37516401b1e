/// Sessions of Foxglove, Lichtblick and other clients of the Foxglove WebSocket protocol.
/// Source: https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include "tools/view/foxglove/hub.hpp"

namespace sls::view::foxglove {

struct Service;

/// Answers the messages of a client. A wrong message is answered with a text; after kMostErrors of
/// them the connection is closed (1008).
class FoxgloveSession final : public Session, public Client {
 public:
  static constexpr int kMostErrors = 32;

  /// `connection` must outlive the session.
  FoxgloveSession(std::shared_ptr<Hub> hub, Connection& connection);
  ~FoxgloveSession() override;
  FoxgloveSession(const FoxgloveSession&) = delete;
  FoxgloveSession& operator=(const FoxgloveSession&) = delete;

  void receive(MessageKind kind, std::string_view message) override;

  Connection& connection() override { return connection_; }
  bool may_call() const override;
  void forget(std::uint32_t subscription_id) override;

 private:
  void receive_text(std::string_view message);
  void receive_binary(std::string_view message);
  void unsubscribe(std::uint32_t subscription_id);
  void call(const ServiceCall& call);
  void answer(const Service& service, std::uint32_t call_id, const OperatorReply& reply);
  void fail(const ServiceCall& call, const std::string& text);
  void note_error(const std::string& text);
  void send_text(Payload text);

  const std::shared_ptr<Hub> hub_;
  Connection& connection_;
  std::set<std::uint32_t> forgotten_;  // of closed channels: the client may still name them
  int errors_ = 0;
  /// Replies may come after the session has ended, so requests hold a weak pointer to this.
  const std::shared_ptr<FoxgloveSession*> self_ = std::make_shared<FoxgloveSession*>(this);
};

}  // namespace sls::view::foxglove

namespace sls::view {

/// Feed and operator must outlive the sessions.
Protocol make_foxglove_protocol(Feed& feed, Operator& requests);

}  // namespace sls::view
