/// Interface of Feed and Operator for sessions; tests implement their own.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "tools/view/live/feed.hpp"
#include "tools/view/live/operator.hpp"

namespace sls::view::foxglove {

class FlightSource {
 public:
  virtual ~FlightSource() = default;
  /// The same functions as in Feed.
  virtual void add(Feed::Listener& listener) = 0;
  virtual void remove(Feed::Listener& listener) = 0;
  virtual void want(TopicId topic) = 0;
  virtual void unwant(TopicId topic) = 0;
  virtual std::vector<Sample> latched(TopicId topic) const = 0;
  /// The same functions as in Operator.
  virtual bool may_ask() const = 0;
  virtual void request(ControlAction action, std::uint64_t steps,
                       std::function<void(const OperatorReply&)> done) = 0;
};

}  // namespace sls::view::foxglove
