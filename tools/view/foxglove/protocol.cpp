#include "tools/view/foxglove/protocol.hpp"

#include "tools/view/foxglove/session.hpp"

namespace sls::view {

namespace {

class LiveSource final : public foxglove::FlightSource {
 public:
  LiveSource(Feed& feed, Operator& requests) : feed_(feed), requests_(requests) {}
  void add(Feed::Listener& listener) override { feed_.add(listener); }
  void remove(Feed::Listener& listener) override { feed_.remove(listener); }
  void want(TopicId topic) override { feed_.want(topic); }
  void unwant(TopicId topic) override { feed_.unwant(topic); }
  std::vector<Sample> latched(TopicId topic) const override { return feed_.latched(topic); }
  bool may_ask() const override { return requests_.may_ask(); }
  void request(ControlAction action, std::uint64_t steps,
               std::function<void(const OperatorReply&)> done) override {
    requests_.request(action, steps, std::move(done));
  }

 private:
  Feed& feed_;
  Operator& requests_;
};

}  // namespace

Protocol make_foxglove_protocol(Feed& feed, Operator& requests) {
  const auto hub = std::make_shared<foxglove::Hub>(std::make_unique<LiveSource>(feed, requests));
  return {{"foxglove.sdk.v1", "foxglove.websocket.v1"}, [hub](Connection& connection) {
            return std::make_unique<foxglove::FoxgloveSession>(hub, connection);
          }};
}

}  // namespace sls::view
