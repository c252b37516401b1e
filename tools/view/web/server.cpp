#include "tools/view/web/server.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <list>
#include <utility>

#include "common/config/config_error.hpp"
#include "tools/view/web/hub.hpp"
#include "tools/view/web/request_text.hpp"

namespace sls::view {
namespace {

/// Time until the next try if no file descriptors are left.
constexpr std::chrono::milliseconds kAcceptPause(100);

/// Connections that do not answer the close frame of `stop` within this time are cut.
constexpr std::chrono::seconds kStopPatience(1);

AccessOptions with_address(AccessOptions options, const std::string& address) {
  options.address = address;
  return options;
}

Tcp::endpoint to_endpoint(const ServerOptions& options) {
  Error error;
  const bool is_name = to_lower(options.address) == "localhost";
  const auto address = net::ip::make_address(is_name ? "127.0.0.1" : options.address, error);
  if (error)
    throw config::ConfigError(fmt::format(
        "--listen: expected an IP address of this machine, got '{}'", quote(options.address)));
  return {address, options.port};
}

[[noreturn]] void fail_listening(const Tcp::endpoint& endpoint, Error error) {
  if (error == net::error::address_in_use || error == net::error::access_denied)
    throw config::ConfigError(
        fmt::format("--port: expected a free port, got {}: {}; choose another with --port N, or "
                    "--port 0",
                    endpoint.port(), error.message()));
  throw config::ConfigError(fmt::format("--listen: expected an address of this machine, got {}: {}",
                                        endpoint.address().to_string(), error.message()));
}

}  // namespace

struct Server::Impl {
  using Acceptor = net::basic_socket_acceptor<Tcp, Executor>;

  explicit Impl(const ServerOptions& options)
      : hub(with_address(options.access, options.address), options.limits),
        acceptor(hub.io.get_executor()),
        accept_timer(hub.io.get_executor()),
        stop_timer(hub.io.get_executor()) {
    check(hub.access);
    listen(to_endpoint(options));
  }

  void listen(const Tcp::endpoint& endpoint);
  void accept();
  void note_accepted(Error error, Socket socket);
  void repeat(Timer& timer, std::chrono::steady_clock::duration period, std::function<void()> task);
  void stop();

  Hub hub;
  Acceptor acceptor;
  Tcp::endpoint listened;
  Timer accept_timer;
  Timer stop_timer;
  std::list<Timer> repetitions;
  bool is_stopping = false;
};

void Server::Impl::listen(const Tcp::endpoint& endpoint) {
  Error error;
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(net::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
  if (error) fail_listening(endpoint, error);
  listened = acceptor.local_endpoint();
}

void Server::Impl::accept() {
  acceptor.async_accept(
      [this](Error error, Socket socket) { note_accepted(error, std::move(socket)); });
}

void Server::Impl::note_accepted(Error error, Socket socket) {
  if (is_stopping) return;
  if (!error) hub.adopt(std::move(socket));
  if (!error || error == net::error::connection_aborted) return accept();
  // No descriptors or no memory are left: the connection waits in the system's queue.
  accept_timer.expires_after(kAcceptPause);
  accept_timer.async_wait([this](Error) {
    if (!is_stopping) accept();
  });
}

void Server::Impl::repeat(Timer& timer, std::chrono::steady_clock::duration period,
                          std::function<void()> task) {
  timer.expires_at(std::max(timer.expiry() + period, std::chrono::steady_clock::now()));
  timer.async_wait([this, &timer, period, task = std::move(task)](Error error) mutable {
    if (error || is_stopping) return;
    task();
    repeat(timer, period, std::move(task));
  });
}

void Server::Impl::stop() {
  if (is_stopping) return;
  is_stopping = true;
  Error ignored;
  acceptor.close(ignored);
  stop_timer.expires_after(kStopPatience);
  stop_timer.async_wait([this](Error) { hub.io.stop(); });
  hub.shut_down([this] { hub.io.stop(); });
}

Server::Server(const ServerOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Server::~Server() = default;

std::uint16_t Server::port() const { return impl_->listened.port(); }

std::string Server::url() const {
  const Tcp::endpoint& endpoint = impl_->listened;
  const std::string address = endpoint.address().to_string();
  return fmt::format(endpoint.address().is_v6() ? "http://[{}]:{}/" : "http://{}:{}/", address,
                     endpoint.port());
}

void Server::add_resource(const std::string& path, Resource resource) {
  add_resource(path, [resource = std::move(resource)](const auto& done) { done(resource); });
}

void Server::add_resource(const std::string& path, MakeResource make) {
  impl_->hub.resources[path] = std::move(make);
}

void Server::add_protocol(Protocol protocol) {
  impl_->hub.protocols.push_back(std::move(protocol));
}

void Server::post(std::function<void()> task) { net::post(impl_->hub.io, std::move(task)); }

void Server::repeat(double period_s, std::function<void()> task) {
  post([impl = impl_.get(), period_s, task = std::move(task)]() mutable {
    Timer& timer = impl->repetitions.emplace_back(impl->hub.io.get_executor());
    timer.expires_at(std::chrono::steady_clock::now());
    impl->repeat(timer, to_duration(period_s), std::move(task));
  });
}

void Server::run() {
  /// Sessions must not outlive `run`, whether it returns or throws.
  struct Ending {
    explicit Ending(Hub& ended) : hub(ended) {}
    ~Ending() { hub.drop_all(); }
    Hub& hub;
  } ending(impl_->hub);
  const auto work = net::make_work_guard(impl_->hub.io);
  impl_->accept();
  impl_->hub.io.run();
}

void Server::stop() {
  post([impl = impl_.get()] { impl->stop(); });
}

std::size_t Server::count_connections() const { return impl_->hub.websockets; }

}  // namespace sls::view
