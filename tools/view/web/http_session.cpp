#include "tools/view/web/http_session.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <boost/beast/http/span_body.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include "tools/view/web/request_text.hpp"
#include "tools/view/web/websocket_connection.hpp"

namespace sls::view {
namespace {

/// Least speed at which a client must take an answer, in addition to the time for a request.
constexpr double kLeastBytesPerSecond = 64 * 1024;

/// After an error the rest of the client's data is read for this time and up to this size. If a
/// connection is closed with unread bytes, its answer is lost.
constexpr double kLingerTime = 1;
constexpr std::size_t kMostDiscarded = 256 * 1024;

std::string_view to_view(beast::string_view text) { return {text.data(), text.size()}; }

/// A protocol and the name that both sides use for it.
struct Choice {
  const Protocol* protocol;
  std::string name;
};

/// Upper and lower case must match, because a browser compares the name that it gets back.
template <class Request>
bool has_subprotocol(const Request& request, const std::string& name) {
  const auto fields = request.equal_range(http::field::sec_websocket_protocol);
  return std::any_of(fields.first, fields.second, [&name](const auto& field) {
    const http::token_list tokens(field.value());
    return std::any_of(tokens.begin(), tokens.end(),
                       [&name](const auto& token) { return token == name; });
  });
}

template <class Request>
std::optional<Choice> choose_protocol(const Request& request,
                                      const std::vector<Protocol>& protocols) {
  for (const Protocol& protocol : protocols)
    for (const std::string& name : protocol.names)
      if (has_subprotocol(request, name)) return Choice{&protocol, name};
  return std::nullopt;
}

/// True if Accept-Encoding offers gzip with a weight other than 0.
template <class Request>
bool accepts_gzip(const Request& request) {
  for (const auto& [name, weights] : http::ext_list(request[http::field::accept_encoding])) {
    if (!beast::iequals(name, "gzip")) continue;
    return std::all_of(weights.begin(), weights.end(), [](const auto& weight) {
      return weight.second.find_first_not_of("0.") != weight.second.npos;
    });
  }
  return false;
}

std::string describe_subprotocols(const std::vector<Protocol>& protocols) {
  std::string names;
  for (const Protocol& protocol : protocols)
    for (const std::string& name : protocol.names) names += (names.empty() ? "" : ", ") + name;
  return names;
}

template <class Response>
void set_common_fields(Response& response) {
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  // No other page may show ours in a frame: a user could click its buttons without seeing them.
  response.set("X-Frame-Options", "DENY");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
}

}  // namespace

HttpSession::HttpSession(Hub& hub, Socket socket)
    : Client(socket),
      hub_(hub),
      socket_(std::move(socket)),
      deadline_(socket_.get_executor()),
      buffer_(hub.limits.request_bytes + 1) {}

void HttpSession::drop() {
  deadline_.cancel();
  Error ignored;
  socket_.close(ignored);
  hub_.remove(this);
}

/// At the deadline pending reads and writes end with an error.
void HttpSession::set_deadline(double seconds) {
  deadline_.expires_after(to_duration(seconds));
  deadline_.async_wait([self = weak_from_this()](Error) {
    const auto session = self.lock();
    if (!session || session->deadline_.expiry() > std::chrono::steady_clock::now()) return;
    Error ignored;
    session->socket_.close(ignored);
  });
}

// --- requests ------------------------------------------------------------------------------------

void HttpSession::read_request() {
  parser_.emplace();
  parser_->header_limit(static_cast<std::uint32_t>(hub_.limits.request_bytes));
  parser_->body_limit(0);
  set_deadline(hub_.limits.request_timeout_s);
  http::async_read_header(
      socket_, buffer_, *parser_,
      [self = shared_from_this()](Error error, std::size_t) { self->note_request(error); });
}

void HttpSession::note_request(Error error) {
  if (error)
    refuse_malformed(error);
  else if (!parser_->is_done())
    refuse(http::status::payload_too_large, "expected a request without a body");
  else
    answer();
}

void HttpSession::refuse_malformed(Error error) {
  if (error == http::error::header_limit || error == http::error::buffer_overflow)
    refuse(http::status::request_header_fields_too_large,
           fmt::format("expected a header of at most {} bytes", hub_.limits.request_bytes));
  else if (error == http::error::body_limit)
    refuse(http::status::payload_too_large, "expected a request without a body");
  else if (error.category() == make_error_code(http::error::bad_method).category() &&
           error != http::error::end_of_stream && error != http::error::partial_message)
    refuse(http::status::bad_request, "expected an HTTP/1.1 request: " + error.message());
  else
    drop();
}

void HttpSession::answer() {
  const auto& request = parser_->get();
  const auto target = parse_target(to_view(request.target()));
  if (!target || request.count(http::field::host) > 1 || request.count(http::field::origin) > 1)
    return refuse(http::status::bad_request,
                  "expected a target /PATH[?QUERY], one Host and at most one Origin");
  RequestOrigin origin{std::string(request[http::field::host]), std::nullopt, target->token};
  if (request.count(http::field::origin) == 1)
    origin.origin = std::string(request[http::field::origin]);
  const Access access = judge(origin, hub_.access);
  if (!access.may_look) return refuse(http::status::forbidden, access.reason);
  if (websocket::is_upgrade(request) && target->path == "/") {
    if (!target->token || !hub_.access.token) return upgrade(origin);
    deadline_.cancel();
    return hub_.judge_token(weak_from_this(), [this, origin] { upgrade(origin); });
  }
  if (request.method() != http::verb::get && request.method() != http::verb::head)
    return refuse(http::status::method_not_allowed, "expected GET or HEAD");
  const auto resource = hub_.resources.find(target->path);
  if (resource == hub_.resources.end())
    return refuse(http::status::not_found, "there is nothing at this path");
  deadline_.cancel();
  resource->second([self = weak_from_this()](const Resource& made) {
    if (const auto session = self.lock()) session->serve(made);
  });
}

void HttpSession::upgrade(const RequestOrigin& origin) {
  const Request request = parser_->get();
  const auto choice = choose_protocol(request, hub_.protocols);
  if (!choice)
    return refuse(
        http::status::bad_request,
        fmt::format("expected a subprotocol of {}, got '{}'", describe_subprotocols(hub_.protocols),
                    quote(to_view(request[http::field::sec_websocket_protocol]))));
  if (buffer_.size() != 0)
    return refuse(http::status::bad_request, "expected no frames before the answer");
  deadline_.cancel();
  const auto connection = std::make_shared<WebSocketConnection>(hub_, std::move(socket_), origin,
                                                                judge(origin, hub_.access));
  hub_.add(connection);
  hub_.remove(this);
  connection->accept(request, *choice->protocol, choice->name);
}

// --- answers -------------------------------------------------------------------------------------

void HttpSession::serve(const Resource& resource) {
  using Body = http::span_body<const char>;
  const auto& request = parser_->get();
  const auto response = std::make_shared<http::response<Body>>(http::status::ok, request.version());
  set_common_fields(*response);
  response->set(http::field::content_type, resource.content_type);
  const bool is_gzip = resource.gzip_body && accepts_gzip(request);
  served_ = is_gzip ? resource.gzip_body : resource.body;
  const std::string& bytes = *served_;
  if (is_gzip) response->set(http::field::content_encoding, "gzip");
  if (resource.gzip_body) response->set(http::field::vary, "Accept-Encoding");
  if (!resource.security_policy.empty())
    response->set("Content-Security-Policy", resource.security_policy);
  response->body() = {bytes.data(), bytes.size()};
  response->content_length(bytes.size());
  response->keep_alive(request.keep_alive());
  write(response, bytes.size());
}

void HttpSession::refuse(http::status status, const std::string& reason) {
  const auto& request = parser_->get();
  const auto response = std::make_shared<http::response<http::string_body>>(status, 11);
  set_common_fields(*response);
  response->set(http::field::content_type, "text/plain; charset=utf-8");
  if (status == http::status::method_not_allowed) response->set(http::field::allow, "GET, HEAD");
  response->body() = reason + "\n";
  response->content_length(response->body().size());
  const bool is_whole = status == http::status::not_found ||
                        status == http::status::method_not_allowed ||
                        status == http::status::forbidden;
  response->keep_alive(is_whole && request.keep_alive());
  write(response, response->body().size());
}

template <class Body>
void HttpSession::write(std::shared_ptr<http::response<Body>> response, std::size_t size) {
  set_deadline(hub_.limits.request_timeout_s + static_cast<double>(size) / kLeastBytesPerSecond);
  const auto serializer = std::make_shared<http::response_serializer<Body>>(*response);
  const auto done = [self = shared_from_this(), response, serializer](Error error, std::size_t) {
    self->note_written(error, response->need_eof());
  };
  if (parser_->is_header_done() && parser_->get().method() == http::verb::head)
    http::async_write_header(socket_, *serializer, done);
  else
    http::async_write(socket_, *serializer, done);
}

void HttpSession::note_written(Error error, bool is_last) {
  served_.reset();
  if (error) return drop();
  if (is_last) return linger();
  read_request();
}

void HttpSession::linger() {
  Error ignored;
  socket_.shutdown(Socket::shutdown_send, ignored);
  set_deadline(kLingerTime);
  buffer_.clear();
  discard();
}

void HttpSession::discard() {
  socket_.async_read_some(buffer_.prepare(buffer_.max_size()),
                          [self = shared_from_this()](Error error, std::size_t count) {
                            self->discarded_ += count;
                            if (error || self->discarded_ > kMostDiscarded) return self->drop();
                            self->discard();
                          });
}

}  // namespace sls::view
