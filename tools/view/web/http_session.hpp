/// HTTP of one connection: resources, errors, upgrade to a WebSocket.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "tools/view/web/hub.hpp"

namespace sls::view {

class HttpSession : public Client, public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(Hub& hub, Socket socket);
  void start() { read_request(); }
  void shut_down() override { drop(); }
  void drop() override;

 private:
  using Request = http::request<http::empty_body>;

  void read_request();
  void note_request(Error error);
  void refuse_malformed(Error error);
  void answer();
  void upgrade(const RequestOrigin& origin);
  void serve(const Resource& resource);
  void refuse(http::status status, const std::string& reason);
  template <class Body>
  void write(std::shared_ptr<http::response<Body>> response, std::size_t size);
  void note_written(Error error, bool is_last);
  void linger();
  void discard();
  void set_deadline(double seconds);

  Hub& hub_;
  Socket socket_;
  Timer deadline_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::size_t discarded_ = 0;
  Payload served_;  // bytes of the answer that is being written
};

}  // namespace sls::view
