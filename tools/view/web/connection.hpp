/// Interface between the server and a WebSocket protocol: the protocol sends on connections, the
/// server calls sessions. All functions run on the server's thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace sls::view {

/// Bytes of one message, shared by the connections that send it.
using Payload = std::shared_ptr<const std::string>;

enum class MessageKind { kText, kBinary };

/// Treatment of a message while the browser is slower than the data.
enum class Delivery {
  kAlways,    ///< the connection is closed if its queue is full
  kNewest,    ///< replaces a queued message of the same `key` that is not being sent yet
  kDroppable  ///< if the queue is full, the oldest droppable message is dropped and counted
};

class Connection {
 public:
  virtual ~Connection() = default;

  /// Queues a message; never blocks. `key`: for kNewest only.
  virtual void send(MessageKind kind, Payload payload, Delivery delivery,
                    std::uint64_t key = 0) = 0;

  /// Bytes queued and not passed to the system yet.
  virtual std::size_t queued_bytes() const = 0;
  /// Messages dropped or replaced so far.
  virtual std::uint64_t dropped() const = 0;

  /// True if this connection may operate a flight (web/access.hpp). `why_not` gives the reason if
  /// not: "expected a token", "started with --read-only".
  virtual bool may_operate() const = 0;
  virtual std::string why_not() const = 0;

  /// Checks the token with which a page was opened, after others have guessed wrong later; passes
  /// true to `judged` if it is correct.
  virtual void authenticate(std::string_view token, std::function<void(bool)> judged) = 0;

  /// Sends the queued messages, then closes with a WebSocket close code (1008: policy) and reason.
  virtual void close(std::uint16_t code, const std::string& reason) = 0;
};

/// The protocol's part for one client; lives as long as its connection.
class Session {
 public:
  virtual ~Session() = default;
  virtual void receive(MessageKind kind, std::string_view message) = 0;
};

using MakeSession = std::function<std::unique_ptr<Session>(Connection&)>;

/// A WebSocket subprotocol by its names, in the order in which the server prefers them.
struct Protocol {
  std::vector<std::string> names;
  MakeSession make_session;
};

}  // namespace sls::view
