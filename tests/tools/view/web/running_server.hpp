/// A server on a free port of 127.0.0.1, in its own thread.
#pragma once

#include <functional>
#include <future>
#include <thread>

#include "tools/view/web/server.hpp"

namespace sls::test {

inline view::ServerOptions make_options() {
  view::ServerOptions options;
  options.port = 0;
  return options;
}

class RunningServer {
 public:
  explicit RunningServer(
      const view::ServerOptions& options = make_options(),
      const std::function<void(view::Server&)>& prepare = [](view::Server&) {})
      : server_(options) {
    prepare(server_);
    thread_ = std::thread([this] { server_.run(); });
  }
  ~RunningServer() { stop(); }

  void stop() {
    server_.stop();
    if (thread_.joinable()) thread_.join();
  }

  view::Server& operator*() { return server_; }
  view::Server* operator->() { return &server_; }
  std::uint16_t port() const { return server_.port(); }

  /// Runs `task` on the server's thread. @returns its result.
  template <class Task>
  auto ask(Task task) {
    std::promise<decltype(task())> promise;
    server_.post([&] { promise.set_value(task()); });
    return promise.get_future().get();
  }

 private:
  view::Server server_;
  std::thread thread_;
};

}  // namespace sls::test
