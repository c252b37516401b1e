/// One WebSocket of a client: its queue, its session, its permissions.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <memory>
#include <optional>
#include <string>

#include "tools/view/web/connection.hpp"
#include "tools/view/web/gathering_stream.hpp"
#include "tools/view/web/hub.hpp"
#include "tools/view/web/send_queue.hpp"

namespace sls::view {

/// Never destroys its session within a call of that session.
class WebSocketConnection : public Connection,
                            public Client,
                            public std::enable_shared_from_this<WebSocketConnection> {
 public:
  WebSocketConnection(Hub& hub, Socket socket, const RequestOrigin& origin, const Access& access);
  ~WebSocketConnection() override;

  /// Answers the request for an upgrade and begins a session of `protocol`, known by `name`.
  void accept(const http::request<http::empty_body>& request, const Protocol& protocol,
              const std::string& name);

  void send(MessageKind kind, Payload payload, Delivery delivery, std::uint64_t key) override;
  std::size_t queued_bytes() const override;
  std::uint64_t dropped() const override { return queue_.dropped(); }
  bool may_operate() const override { return access_.may_operate; }
  std::string why_not() const override { return access_.reason; }
  void authenticate(std::string_view token, std::function<void(bool)> judged) override;
  void close(std::uint16_t code, const std::string& reason) override;

  std::size_t waiting_bytes() const override { return queue_.cost(); }
  void relieve() override;
  void shut_down() override;
  void drop() override;

 private:
  void set_options(const std::string& subprotocol);
  void begin_session(Error error, const Protocol& protocol);
  void read();
  void note_read(Error error);
  void receive();
  bool judge_token(std::string_view token);
  void write_next();
  /// Call it after each change of `queue_`.
  void count_waiting();
  void note_written(Error error);
  void write_close();
  void close_slow();

  Hub& hub_;
  RequestOrigin origin_;
  Access access_;
  websocket::stream<GatheringStream, false> stream_;  ///< false: no compression
  Timer close_timer_;
  beast::flat_buffer buffer_;
  SendQueue queue_;
  std::size_t counted_ = 0;  ///< bytes of `queue_` in hub_.waiting_bytes
  std::optional<QueuedMessage> leaving_;
  std::unique_ptr<Session> session_;
  std::optional<websocket::close_reason> close_reason_;  ///< to be sent after the queue
  bool is_judging_ = false;  ///< a token waits; nothing is read meanwhile
  bool is_open_ = false;     ///< the upgrade is answered
  bool is_close_sent_ = false;
  bool has_ended_ = false;
  int wrong_tokens_ = 0;
};

}  // namespace sls::view
