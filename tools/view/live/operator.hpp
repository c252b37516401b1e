/// Sends operator requests of browsers over sls/control at once; replies come in any order.
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
  std::string reason;      ///< reason of a refusal
  std::uint64_t step = 0;  ///< step at which the request took effect
};

class Operator {
 public:
  /// `may_ask`: false if the keys of the secured domain are not an operator's. `timeout_s`: to find
  /// a run, and again for its reply.
  Operator(bus::Node& node, std::uint32_t vehicle_id, Feed::Post post, bool may_ask,
           double timeout_s = 5.0);
  virtual ~Operator();

  virtual bool may_ask() const;
  /// Sends a request to the vehicle's run and calls `done` once, on the server's thread, unless
  /// this object has been destroyed. At most 8 requests wait; further ones are refused. The
  /// destructor does not wait for replies.
  virtual void request(ControlAction action, std::uint64_t steps,
                       std::function<void(const OperatorReply&)> done);

 protected:
  Operator();  ///< of a test's own, which overrides all

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// False if the keys of a secured domain do not allow `node` to operate.
bool may_write_requests(bus::Node& node);

/// "pause" → ControlAction::ACTION_PAUSE; nothing for any other word.
std::optional<ControlAction> find_action(std::string_view word);

}  // namespace sls::view
