#include "tools/view/web/hub.hpp"

#include <netinet/tcp.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/detail/socket_option.hpp>
#include <tuple>

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

std::string name_network(const Socket& socket) {
  Error ignored;
  const net::ip::address address = unmap(socket.remote_endpoint(ignored).address());
  if (address.is_loopback()) return "loopback";
  if (address.is_v4()) return address.to_string();
  auto bytes = address.to_v6().to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), 0);
  return net::ip::address_v6(bytes).to_string() + "/64";
}

}  // namespace

Client::Client(const Socket& socket) : address(name_network(socket)) {}

void Hub::adopt(Socket socket) {
  set_options(socket);
  const auto session = std::make_shared<HttpSession>(*this, std::move(socket));
  make_room(session->address);
  add(session);
  session->start();
}

/// A new client may be an operator, which only its messages show. So it gets in. The connection
/// that ends for it is no operator's if possible, then of the address with most connections, then
/// the one that reads least, then the oldest.
void Hub::make_room(const std::string& address) {
  std::map<std::string, std::size_t> counts;
  std::size_t lookers = 0;  // of the new client's address
  for (const auto& [key, client] : clients_) {
    ++counts[client->address];
    if (client->address == address && !client->may_operate()) ++lookers;
  }
  const bool is_full = clients_.size() >= limits.connections;
  if (!is_full && lookers < limits.connections_per_address) return;
  const auto rank = [&counts](const Client& client) {
    return std::tuple(!client.may_operate(), counts[client.address], client.waiting_bytes(),
                      ~client.number);
  };
  std::shared_ptr<Client> worst;
  for (const auto& [key, client] : clients_)
    if ((is_full || (client->address == address && !client->may_operate())) &&
        (!worst || rank(*client) > rank(*worst)))
      worst = client;
  warn(fmt::format("{} connections, {} of one address: one was closed for a new one",
                   clients_.size(), counts[worst->address]));
  worst->drop();
}

void Hub::limit_queues() {
  while (waiting_bytes > limits.all_queues_bytes) {
    const auto slowest =
        std::max_element(clients_.begin(), clients_.end(), [](const auto& a, const auto& b) {
          return a.second->waiting_bytes() < b.second->waiting_bytes();
        });
    slowest->second->relieve();
  }
}

void Hub::warn(const std::string& text) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_warning_) return;
  next_warning_ = now + kWarningInterval;
  spdlog::warn("{}", quote(text));
}

void Hub::judge_token(const std::weak_ptr<Client>& client, std::function<void()> judge) {
  const auto owner = client.lock();
  if (!owner) return;
  const auto wait = tries_.find_wait(owner->address, TokenTries::Clock::now());
  if (wait <= wait.zero()) return judge();
  const auto timer = std::make_shared<Timer>(io.get_executor(), wait);
  timer->async_wait([this, timer, client, judge = std::move(judge)](Error) mutable {
    judge_token(client, std::move(judge));
  });
}

void Hub::note_wrong_token(const std::string& network) {
  const auto now = TokenTries::Clock::now();
  tries_.note_wrong(network, now);
  ++wrong_tokens_;
  if (now < next_token_warning_) return;
  next_token_warning_ = now + kWarningInterval;
  spdlog::warn("wrong token from {} (wrong ones since the start: {})", network, wrong_tokens_);
}

void Hub::add(std::shared_ptr<Client> client) {
  Client* const key = client.get();
  client->number = next_number_++;
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
