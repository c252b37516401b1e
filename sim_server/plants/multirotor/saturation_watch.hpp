/// Remarks on rotors with a set-point at or above their largest speed.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/config/numbers.hpp"
#include "sim_server/plants/multirotor/airframe.hpp"

namespace sls::sim {

/// Makes a remark when the set-point of a rotor is at or above its largest speed for over 1 s.
class SaturationWatch {
 public:
  SaturationWatch(std::size_t rotors, std::int64_t step_ns)
      : since_(rotors, -1), patient_steps_(kPatience_ns / step_ns) {}

  /// Call once the set-points of `step` are known.
  void look(const std::vector<FlyingRotor>& rotors, const Eigen::VectorXd& set_points,
            std::int64_t step, double step_s) {
    for (std::size_t i = 0; i < rotors.size(); ++i) {
      std::int64_t& since = since_[i];
      if (set_points[static_cast<Eigen::Index>(i)] < rotors[i].max_speed) {
        since = -1;
        continue;
      }
      if (since < 0) since = step;
      if (step - since != patient_steps_ + 1 || remarks_said_ == kMostRemarks) continue;
      ++remarks_said_;
      remarks_.push_back("rotor " + std::to_string(i + 1) + " at its largest speed (" +
                         config::to_text(rotors[i].max_speed) +
                         " rad/s) for more than 1 s, since " +
                         config::to_text(static_cast<double>(since) * step_s) + " s");
    }
  }

  std::vector<std::string> take_remarks() { return std::exchange(remarks_, {}); }
  void add(std::string remark) { remarks_.push_back(std::move(remark)); }

 private:
  static constexpr std::int64_t kPatience_ns = 1'000'000'000;
  static constexpr int kMostRemarks = 20;  // in a flight

  std::vector<std::int64_t> since_;  // first saturated step of each rotor, or −1
  const std::int64_t patient_steps_;
  int remarks_said_ = 0;
  std::vector<std::string> remarks_;
};

}  // namespace sls::sim
