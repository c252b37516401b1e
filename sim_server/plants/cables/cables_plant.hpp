/// The plant: vehicles, one load, and cables that go slack and taut. README.md.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim_server/plants/cables/hybrid_motion.hpp"
#include "sim_server/plants/cables/start.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::sim {

class CablesPlant : public Plant {
 public:
  /// All vehicles of `setup` at their initial states.
  /// @throws config::ConfigError if the scenario describes another number of cables.
  explicit CablesPlant(const PlantSetup& setup);

  void advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) override;
  /// p_WL and v_WL are those of the end of the vehicle's own cable.
  const model::Measurement& measurement(std::size_t vehicle) const override {
    return measurements_[vehicle];
  }
  std::vector<Signal> signals() const override;
  std::vector<std::string> take_remarks(std::size_t vehicle) override;

 private:
  explicit CablesPlant(const PlantSetup& setup, const cables::Start& start);
  model::Measurement measure(std::size_t vehicle) const;
  void note(const cables::Event& event);

  const cables::System system_;
  const double step_s_;
  cables::HybridMotion motion_;
  cables::Actions actions_;
  std::int64_t steps_ = 0;
  std::vector<cables::Event> events_;  // of one step; a member to avoid allocation
  std::vector<model::Measurement> measurements_;
  std::vector<std::vector<std::string>> remarks_;
  std::vector<int> remark_counts_;  // made so far, of each vehicle
};

}  // namespace sls::sim
