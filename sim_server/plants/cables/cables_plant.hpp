/// The plant: vehicles, one load, and cables that go slack and taut. README.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim_server/plants/air/air.hpp"
#include "sim_server/plants/cables/flying_rotors.hpp"
#include "sim_server/plants/cables/hybrid_motion.hpp"
#include "sim_server/plants/cables/start.hpp"
#include "sim_server/plants/cables/winch.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::sim {

class CablesPlant : public Plant {
 public:
  /// All vehicles of `setup` at their initial states.
  /// @throws config::ConfigError if the scenario describes another number of cables, or an
  ///   autopilot refuses it.
  explicit CablesPlant(const PlantSetup& setup);
  CablesPlant(const CablesPlant&) = delete;
  CablesPlant& operator=(const CablesPlant&) = delete;

  void advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) override;
  /// p_WL and v_WL are those of the end of the vehicle's own cable.
  const model::Measurement& measurement(std::size_t vehicle) const override {
    return measurements_[vehicle];
  }
  bool has_attitude() const override { return rotors_.has_value(); }
  std::vector<Signal> signals() const override { return signals_; }
  std::vector<std::string> take_remarks(std::size_t vehicle) override;

 private:
  CablesPlant(const PlantSetup& setup, const cables::Start& start);
  /// A change of a cable that the scenario plans.
  struct Change {
    double time;  ///< s
    std::size_t cable;
    std::optional<cables::WinchPhase> phase;  ///< of its winch; none: it is cut
    std::string remark;                       ///< without the time; may be empty
  };

  void plan(const CablesKeys& keys);
  std::vector<Signal> list_signals() const;
  void fly_step();
  void hold_wind(double start);
  void apply(const Change& change);
  model::Measurement measure(std::size_t vehicle) const;
  void note(const cables::Event& event);
  void judge_step();
  /// What a remark is about. Each has its own quota, so that bounces do not use up that of others.
  enum class Topic { kPlan, kCable, kGround, kEvents, kStep };
  static constexpr std::size_t kTopics = 5;
  void remark(std::size_t vehicle, Topic topic, const std::string& text);

  const cables::System system_;
  const Air air_;
  cables::Vectors v_wind_W_;  // at each vehicle, held over a step, m/s
  const double step_s_;
  cables::HybridMotion motion_;
  std::optional<cables::FlyingRotors> rotors_;  // none: point masses
  cables::Actions actions_;
  std::int64_t steps_ = 0;
  std::vector<Change> changes_;  // by time
  std::size_t next_change_ = 0;
  std::vector<std::optional<cables::WinchPhase>> phases_;  // that hold now, of each cable
  bool has_winch_ = false, has_release_ = false, has_stretch_ = false;  // any cable
  std::vector<Signal> signals_;
  Eigen::Index own_signals_;           // those before the signals of the air
  std::vector<cables::Event> events_;  // of one step; a member to avoid allocation
  std::vector<model::Measurement> measurements_;
  std::vector<std::vector<std::string>> remarks_;
  std::vector<std::array<int, kTopics>> remark_counts_;  // made so far, of each vehicle
  std::int64_t named_step_ns_;  // the finest that a remark has named, or the own
};

}  // namespace sls::sim
