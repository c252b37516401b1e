#include "tools/view/web/hub.hpp"

#include <netinet/tcp.h>
#include <spdlog/spdlog.h>

#include <boost/asio/detail/socket_option.hpp>

#include "tools/view/web/http_session.hpp"
#include "tools/view/web/request_text.hpp"

namespace sls::view {
namespace {

constexpr std::chrono::seconds kWarningInterval(10);

/// Limit of unsent bytes in the system's buffer. Messages there can no longer be replaced by newer
/// ones, and they take memory for a client that does not read.
constexpr int kMostUnsent = 64 * 1024;

void set_options(Socket& socket) {
  using UnsentLimit = net::detail::socket_option::integer<IPPROTO_TCP, TCP_NOTSENT_LOWAT>;
  Error ignored;  // without these options it is only slower
  socket.set_option(Tcp::no_delay(true), ignored);
  socket.set_option(UnsentLimit(kMostUnsent), ignored);
}

}  // namespace

void Hub::adopt(Socket socket) {
  if (clients_.size() >= limits.connections) {
    warn(fmt::format("all {} connections are in use; another one was refused", limits.connections));
    return;
  }
  set_options(socket);
  const auto session = std::make_shared<HttpSession>(*this, std::move(socket));
  add(session);
  session->start();
}

void Hub::warn(const std::string& text) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_warning_) return;
  next_warning_ = now + kWarningInterval;
  spdlog::warn("{}", quote(text));
}

void Hub::add(std::shared_ptr<Client> client) {
  Client* const key = client.get();
  clients_.emplace(key, std::move(client));
}

void Hub::remove(Client* client) {
  clients_.erase(client);
  if (clients_.empty() && done_) done_();
}

void Hub::shut_down(std::function<void()> done) {
  done_ = std::move(done);
  const auto all = clients_;  // they remove themselves
  for (const auto& [key, client] : all) client->shut_down();
  if (clients_.empty()) done_();
}

void Hub::drop_all() {
  const auto all = clients_;
  for (const auto& [key, client] : all) client->drop();
}

}  // namespace sls::view
