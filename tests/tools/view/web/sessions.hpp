/// Sessions of the web tests.
#pragma once

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/tools/view/web/running_server.hpp"
#include "tools/view/web/connection.hpp"

namespace sls::test {

inline view::Payload make_payload(std::string bytes) {
  return std::make_shared<const std::string>(std::move(bytes));
}

/// Returns each message, with these exceptions: "may" gets "yes" or the reason why the client may
/// not operate, "token …" gets "right" or that reason, "close" closes after three more messages,
/// and "throw" throws an exception.
class Echo : public view::Session {
 public:
  explicit Echo(view::Connection& connection) : connection_(connection) {}

  void receive(view::MessageKind kind, std::string_view message) override {
    if (message == "may") return answer(connection_.may_operate() ? "yes" : connection_.why_not());
    if (message.substr(0, 6) == "token ")
      return connection_.authenticate(message.substr(6), [this](bool is_right) {
        answer(is_right ? "right" : connection_.why_not());
      });
    if (message == "throw") throw std::runtime_error("as asked");
    if (message == "close") {
      for (const char* text : {"1", "2", "3"}) answer(text);
      connection_.close(4000, "as asked");
      return answer("4");
    }
    connection_.send(kind, make_payload(std::string(message)), view::Delivery::kAlways);
  }

 private:
  void answer(const std::string& text) {
    connection_.send(view::MessageKind::kText, make_payload(text), view::Delivery::kAlways);
  }
  view::Connection& connection_;
};

inline view::Protocol make_echo(std::vector<std::string> names) {
  return {std::move(names),
          [](view::Connection& connection) { return std::make_unique<Echo>(connection); }};
}

/// Keeps a list of open connections in order of arrival; use the list on the server's thread only.
class Listed : public view::Session {
 public:
  using List = std::vector<view::Connection*>;
  Listed(view::Connection& connection, List& list) : connection_(connection), list_(list) {
    list_.push_back(&connection_);
  }
  ~Listed() override { list_.erase(std::find(list_.begin(), list_.end(), &connection_)); }
  void receive(view::MessageKind, std::string_view) override {}

 private:
  view::Connection& connection_;
  List& list_;
};

inline view::Protocol make_listed(Listed::List& list) {
  return {{"listed"}, [&list](view::Connection& connection) {
            return std::make_unique<Listed>(connection, list);
          }};
}

/// The page, a file, and the protocols `echo.2` and `echo.1`.
inline void add_echo_and_page(view::Server& server) {
  server.add_resource("/", {"text/html; charset=utf-8", make_payload("the page"),
                            make_payload("zipped"), "default-src 'none'"});
  server.add_resource("/recording/0", {"application/octet-stream",
                                       make_payload(std::string(3'000'000, 'r')), nullptr, ""});
  server.add_protocol(make_echo({"echo.2", "echo.1"}));
  server.add_protocol(make_echo({"other"}));
}

}  // namespace sls::test
