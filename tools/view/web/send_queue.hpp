/// Messages that wait to be sent to one client. Pure: no network.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <optional>
#include <unordered_map>

#include "tools/view/web/connection.hpp"

namespace sls::view {

struct QueuedMessage {
  MessageKind kind;
  Payload payload;
  Delivery delivery;
  std::uint64_t key;  ///< for kNewest only
};

class SendQueue {
 public:
  /// `capacity`: bytes of the messages, including the overhead of each beside its payload.
  explicit SendQueue(std::size_t capacity) : capacity_(capacity) {}

  /// False if a kAlways message does not fit, even without the droppable ones. A kNewest or
  /// kDroppable message that does not fit then is dropped.
  bool push(MessageKind kind, Payload payload, Delivery delivery, std::uint64_t key);

  std::optional<QueuedMessage> pop();
  void clear();

  std::size_t bytes() const { return bytes_; }  ///< of payloads
  std::size_t cost() const;                     ///< with the overhead of each message
  /// Drops all droppable messages; false if there was none.
  bool drop_droppable();
  /// Messages dropped or replaced.
  std::uint64_t dropped() const { return dropped_; }

 private:
  using Place = std::list<QueuedMessage>::iterator;

  bool replace(const QueuedMessage& message);
  bool make_room(std::size_t payload_bytes);
  bool fits(std::size_t payload_bytes) const;
  bool drop_oldest();
  void forget(Place place);

  const std::size_t capacity_;
  std::size_t bytes_ = 0;
  std::uint64_t dropped_ = 0;
  std::list<QueuedMessage> messages_;
  std::deque<Place> droppable_;                      ///< oldest first
  std::unordered_map<std::uint64_t, Place> newest_;  ///< by key
};

}  // namespace sls::view
