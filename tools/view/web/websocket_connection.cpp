#include "tools/view/web/websocket_connection.hpp"

#include <algorithm>
#include <exception>

namespace sls::view {
namespace {

constexpr int kMostWrongTokens = 5;

/// A client that does not take the queued messages and answer the close frame in this time is cut.
constexpr double kCloseTimeout = 5;

/// The longest prefix of UTF-8 text that a close frame holds.
std::string shorten(const std::string& text) {
  std::size_t size = std::min<std::size_t>(text.size(), websocket::reason_string().max_size());
  const auto is_inside = [&text](std::size_t i) { return (text[i] & 0xc0) == 0x80; };
  while (size < text.size() && size > 0 && is_inside(size)) --size;
  return text.substr(0, size);
}

}  // namespace

WebSocketConnection::WebSocketConnection(Hub& hub, Socket socket, const RequestOrigin& origin,
                                         const Access& access)
    : Client(socket),
      hub_(hub),
      origin_(origin),
      access_(access),
      stream_(GatheringStream(std::move(socket))),
      close_timer_(stream_.get_executor()),
      queue_(hub.limits.queue_bytes) {
  if (origin.token && hub.access.token && !is_same_token(*origin.token, *hub.access.token)) {
    ++wrong_tokens_;
    hub.note_wrong_token(address);
  }
}

WebSocketConnection::~WebSocketConnection() = default;

// --- the session ---------------------------------------------------------------------------------

void WebSocketConnection::accept(const http::request<http::empty_body>& request,
                                 const Protocol& protocol, const std::string& name) {
  set_options(name);
  stream_.async_accept(request, [self = shared_from_this(), &protocol](Error error) {
    self->begin_session(error, protocol);
  });
}

void WebSocketConnection::set_options(const std::string& subprotocol) {
  websocket::stream_base::timeout timeout;
  timeout.handshake_timeout = to_duration(hub_.limits.request_timeout_s);
  timeout.idle_timeout = to_duration(hub_.limits.silence_timeout_s);
  timeout.keep_alive_pings = true;
  stream_.set_option(timeout);
  stream_.set_option(
      websocket::stream_base::decorator([subprotocol](websocket::response_type& response) {
        if (response.result() == http::status::switching_protocols)
          response.set(http::field::sec_websocket_protocol, subprotocol);
      }));
  stream_.read_message_max(hub_.limits.message_bytes);
  stream_.auto_fragment(false);
}

void WebSocketConnection::begin_session(Error error, const Protocol& protocol) {
  if (error || has_ended_) return drop();
  is_open_ = true;
  ++hub_.websockets;
  if (close_reason_) return write_next();
  try {
    session_ = protocol.make_session(*this);
  } catch (const std::exception& problem) {
    hub_.warn(std::string("a session could not begin: ") + problem.what());
    close(websocket::close_code::internal_error, "internal error");
  }
  read();
}

void WebSocketConnection::read() {
  stream_.async_read(
      buffer_, [self = shared_from_this()](Error error, std::size_t) { self->note_read(error); });
}

void WebSocketConnection::note_read(Error error) {
  if (error || has_ended_) return drop();
  if (!close_reason_) receive();
  buffer_.consume(buffer_.size());
  if (!is_judging_) read();
}

void WebSocketConnection::receive() {
  const auto bytes = buffer_.data();
  try {
    session_->receive(stream_.got_text() ? MessageKind::kText : MessageKind::kBinary,
                      {static_cast<const char*>(bytes.data()), bytes.size()});
  } catch (const std::exception& problem) {
    hub_.warn(std::string("a message of a client failed: ") + problem.what());
    close(websocket::close_code::internal_error, "internal error");
  }
}

void WebSocketConnection::authenticate(std::string_view token, std::function<void(bool)> judged) {
  if (access_.may_operate) return judged(true);
  is_judging_ = true;
  const auto is_late = std::make_shared<bool>(false);
  hub_.judge_token(weak_from_this(),
                   [this, is_late, judged = std::move(judged), token = std::string(token)] {
                     is_judging_ = false;
                     if (has_ended_) return;
                     judged(judge_token(token));
                     if (*is_late) read();
                   });
  *is_late = true;
}

bool WebSocketConnection::judge_token(std::string_view token) {
  RequestOrigin request = origin_;
  request.token = token;
  access_ = judge(request, hub_.access);
  if (hub_.access.token && !is_same_token(token, *hub_.access.token)) {
    hub_.note_wrong_token(address);
    if (++wrong_tokens_ >= kMostWrongTokens)
      close(websocket::close_code::policy_error, "too many wrong tokens");
  }
  return access_.may_operate;
}

// --- sending -------------------------------------------------------------------------------------

void WebSocketConnection::send(MessageKind kind, Payload payload, Delivery delivery,
                               std::uint64_t key) {
  if (close_reason_ || has_ended_) return;
  if (!queue_.push(kind, std::move(payload), delivery, key)) return close_slow();
  write_next();
  count_waiting();
  hub_.limit_queues();
}

void WebSocketConnection::close_slow() {
  queue_.clear();
  count_waiting();
  close(websocket::close_code::policy_error, "too slow: the queue is full");
}

void WebSocketConnection::relieve() {
  if (!queue_.drop_droppable()) return close_slow();
  count_waiting();
}

void WebSocketConnection::count_waiting() {
  hub_.waiting_bytes += queue_.cost() - counted_;
  counted_ = queue_.cost();
}

std::size_t WebSocketConnection::queued_bytes() const {
  return queue_.bytes() + (leaving_ ? leaving_->payload->size() : 0) +
         stream_.next_layer().pending_bytes();
}

void WebSocketConnection::write_next() {
  if (!is_open_ || leaving_ || has_ended_ || is_close_sent_) return;
  leaving_ = queue_.pop();
  count_waiting();
  if (!leaving_) {
    if (close_reason_) write_close();
    return;
  }
  stream_.binary(leaving_->kind == MessageKind::kBinary);
  stream_.async_write(
      net::buffer(*leaving_->payload),
      [self = shared_from_this()](Error error, std::size_t) { self->note_written(error); });
}

void WebSocketConnection::note_written(Error error) {
  leaving_.reset();
  if (error) return drop();
  write_next();
}

// --- the end -------------------------------------------------------------------------------------

void WebSocketConnection::close(std::uint16_t code, const std::string& reason) {
  if (close_reason_ || has_ended_) return;
  close_reason_.emplace(static_cast<websocket::close_code>(code), shorten(reason));
  close_timer_.expires_after(to_duration(kCloseTimeout));
  close_timer_.async_wait([self = weak_from_this()](Error error) {
    const auto connection = self.lock();
    if (!error && connection) connection->drop();
  });
  write_next();
}

void WebSocketConnection::write_close() {
  is_close_sent_ = true;
  stream_.async_close(*close_reason_, [self = shared_from_this()](Error) { self->drop(); });
}

void WebSocketConnection::shut_down() {
  queue_.clear();
  count_waiting();
  close(websocket::close_code::going_away, "sls_view ends");
}

void WebSocketConnection::drop() {
  if (has_ended_) return;
  has_ended_ = true;
  const auto self = shared_from_this();
  close_timer_.cancel();
  stream_.next_layer().close();
  queue_.clear();
  count_waiting();
  session_.reset();
  if (is_open_) --hub_.websockets;
  hub_.remove(this);
}

}  // namespace sls::view
