/// Operator requests of browsers: one after another over sls/control.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/bus/node.hpp"
#include "tools/view/live/feed.hpp"

namespace sls::view {

struct OperatorReply {
  bool is_accepted = false;
  std::string reason;      ///< why not, in words
  std::uint64_t step = 0;  ///< at which it took effect
};

class Operator {
 public:
  /// `may_ask`: false if the keys of the secured domain are not an operator's.
  Operator(bus::Node& node, std::uint32_t vehicle_id, Feed::Post post, bool may_ask);
  ~Operator();

  bool may_ask() const;
  /// Asks the run of the vehicle; `done` is called once, on the server's thread, but not any more
  /// once this has been destroyed. At most 8 requests wait; one more is refused. Ends with the
  /// reply that it waits for, at a stop signal at once.
  void request(ControlAction action, std::uint64_t steps,
               std::function<void(const OperatorReply&)> done);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// False if the keys of a secured domain do not allow `node` to operate.
bool may_write_requests(bus::Node& node);

/// "pause" → ACTION_PAUSE; nothing for any other word.
std::optional<ControlAction> find_action(std::string_view word);

}  // namespace sls::view
