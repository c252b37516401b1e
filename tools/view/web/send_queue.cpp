#include "tools/view/web/send_queue.hpp"

#include <utility>

namespace sls::view {
namespace {

/// Overhead of a message beside its payload: nodes of list and table, the payload's string.
constexpr std::size_t kMessageCost = 256;

}  // namespace

bool SendQueue::push(MessageKind kind, Payload payload, Delivery delivery, std::uint64_t key) {
  QueuedMessage message{kind, std::move(payload), delivery, key};
  if (delivery == Delivery::kNewest && replace(message)) return true;
  if (!make_room(message.payload->size())) {
    ++dropped_;
    return delivery != Delivery::kAlways;
  }
  bytes_ += message.payload->size();
  const Place place = messages_.insert(messages_.end(), std::move(message));
  if (delivery == Delivery::kDroppable) droppable_.push_back(place);
  if (delivery == Delivery::kNewest) newest_[key] = place;
  return true;
}

/// Puts a kNewest message in the place of an older one with its key, so a stream that is faster
/// than its client keeps its place in the queue. True if there was an older one; it stays if the
/// new one does not fit.
bool SendQueue::replace(const QueuedMessage& message) {
  const auto found = newest_.find(message.key);
  if (found == newest_.end()) return false;
  QueuedMessage& queued = *found->second;
  ++dropped_;
  const std::size_t old_bytes = queued.payload->size();
  const std::size_t new_bytes = message.payload->size();
  if (new_bytes > old_bytes && !make_room(new_bytes - old_bytes)) return true;
  bytes_ = bytes_ - old_bytes + new_bytes;
  queued = message;
  return true;
}

/// Drops droppable messages until `payload_bytes` fit; drops none if they exceed the capacity.
bool SendQueue::make_room(std::size_t payload_bytes) {
  if (payload_bytes > capacity_) return false;
  while (!fits(payload_bytes))
    if (!drop_oldest()) return false;
  return true;
}

bool SendQueue::fits(std::size_t payload_bytes) const {
  return cost() + payload_bytes + kMessageCost <= capacity_;
}

std::size_t SendQueue::cost() const { return bytes_ + messages_.size() * kMessageCost; }

bool SendQueue::drop_droppable() {
  bool has_dropped = false;
  while (drop_oldest()) has_dropped = true;
  return has_dropped;
}

bool SendQueue::drop_oldest() {
  if (droppable_.empty()) return false;
  const Place oldest = droppable_.front();
  ++dropped_;
  forget(oldest);
  messages_.erase(oldest);
  return true;
}

/// Removes a message that leaves the queue from the lists that refer to it.
void SendQueue::forget(Place place) {
  bytes_ -= place->payload->size();
  // Droppable messages leave in order, the oldest first.
  if (place->delivery == Delivery::kDroppable) droppable_.pop_front();
  if (place->delivery == Delivery::kNewest) newest_.erase(place->key);
}

std::optional<QueuedMessage> SendQueue::pop() {
  if (messages_.empty()) return std::nullopt;
  forget(messages_.begin());
  QueuedMessage message = std::move(messages_.front());
  messages_.pop_front();
  return message;
}

void SendQueue::clear() {
  messages_.clear();
  droppable_.clear();
  newest_.clear();
  bytes_ = 0;
}

}  // namespace sls::view
