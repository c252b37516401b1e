#pragma once

#include <chrono>
#include <string>
#include <utility>

#include "worlds/program.hpp"

namespace sls::worlds {

/// An operator who sends requests and does not wait for the replies. Half of the requests are
/// followed by one that must change nothing: the same again, or one that is refused.
class OperatorProgram : public Program {
 public:
  OperatorProgram(Setting& setting, Host& host, std::string name)
      : Program(setting, host, Role::kOperator, std::move(name)), random_(setting.random.split()) {}

  void start() override {
    peer_.add_writer<SimControl>();
    setting_.network.announce(peer_);
  }
  void request(std::uint64_t run_id, ControlAction action, std::uint64_t steps) {
    SimControl message;
    message.run_id(run_id);
    message.request_id(++requests_);
    message.operator_name(random_.chance(0.9) ? "operator@world" : random_.chance(0.5) ? "\n" : "");
    message.action(action);
    message.steps(steps);
    peer_.write(message);
    if (random_.chance(0.5)) peer_.write(random_.chance(0.3) ? message : make_wrong(message));
    const int more = random_.chance(0.02) ? 70 : 0;  // than a server remembers
    for (int i = 0; i < more; ++i) peer_.write(make_wrong(message));
  }

 private:
  SimControl make_wrong(SimControl message) {
    message.request_id(++requests_);
    switch (random_.integer(0, 3)) {
      case 0:
        message.run_id(message.run_id() + 1);
        break;
      case 1:
        message.vehicle_id(77);
        break;
      case 2:
        message.action(static_cast<ControlAction>(99));
        break;
      default:
        message.action(ControlAction::ACTION_STEP);
        message.steps(0);
    }
    return message;
  }
  void wake() override {}

  Random random_;
  std::uint64_t requests_ = 0;
};

}  // namespace sls::worlds
