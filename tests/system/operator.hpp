/// An operator in the test's own process: sends requests to a running server within milliseconds,
/// and reads sls/status.
#pragma once

#include <mutex>
#include <string>

#include "tests/system/process.hpp"
#include "tools/ctl/operator_client.hpp"

namespace sls::test {

class Operator {
 public:
  explicit Operator(int domain)
      : node_(qos("default"), domain, "operator"),
        client_(node_, {domain, 0, 60.0}),
        status_reader_(node_, bus::kLatchedReaderProfile,
                       [this](const SimStatus& status, const bus::PeerId&) {
                         const std::lock_guard lock(mutex_);
                         phase_ = status.phase();
                         ++samples_;
                       }) {}

  /// Empty if the server executed the request, otherwise the reason.
  std::string ask(ControlAction action, std::uint64_t steps = 0) {
    try {
      const auto reply = client_.ask(*client_.wait_for_run(), action, steps);
      return reply->accepted() ? "" : "refused: " + reply->reason().to_string();
    } catch (const std::exception& error) {
      return error.what();
    }
  }

  /// False if the server does not report `phase` before the deadline.
  bool wait_for(RunPhase phase) {
    return wait_until([&] {
      const std::lock_guard lock(mutex_);
      return samples_ > 0 && phase_ == phase;
    });
  }

  /// Waits for `count` further statuses. Without events each takes at least 0.4 s.
  bool wait_for_statuses(std::size_t count) {
    const std::size_t before = samples();
    return wait_until([&] { return samples() >= before + count; });
  }

 private:
  std::size_t samples() const {
    const std::lock_guard lock(mutex_);
    return samples_;
  }

  bus::Node node_;
  ctl::OperatorClient client_;
  mutable std::mutex mutex_;  // protects the two members below
  RunPhase phase_ = RunPhase::PHASE_WAITING;
  std::size_t samples_ = 0;
  bus::Reader<SimStatus> status_reader_;  // last: its handler uses the members above
};

}  // namespace sls::test
