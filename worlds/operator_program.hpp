#pragma once

#include <string>
#include <utility>

#include "worlds/program.hpp"

namespace sls::worlds {

/// An operator who sends requests and does not wait for the replies.
class OperatorProgram : public Program {
 public:
  OperatorProgram(Setting& setting, Host& host, std::string name)
      : Program(setting, host, Role::kOperator, std::move(name)) {}

  void start() override {
    peer_.add_writer<SimControl>();
    setting_.network.announce(peer_);
  }
  void request(std::uint64_t run_id, ControlAction action, std::uint64_t steps) {
    SimControl message;
    message.run_id(run_id);
    message.request_id(++requests_);
    message.operator_name("operator@world");
    message.action(action);
    message.steps(steps);
    peer_.write(message);
  }

 private:
  void wake() override {}
  std::uint64_t requests_ = 0;
};

}  // namespace sls::worlds
