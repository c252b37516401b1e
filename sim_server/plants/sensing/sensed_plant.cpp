#include "sim_server/plants/sensing/sensed_plant.hpp"

#include <algorithm>
#include <utility>

#include "common/model/offset.hpp"
#include "sim_server/plants/sensing/delay_line.hpp"
#include "sim_server/plants/sensing/sample_clock.hpp"
#include "sim_server/plants/sensing/sensor_group.hpp"

namespace sls::sim {
namespace {

bool is_exact(const config::Estimator& estimator) {
  return estimator.position.isZero(0.0) && estimator.velocity.isZero(0.0) &&
         estimator.attitude.is_zero();
}

/// The rod as its sensors show it.
struct RodSample {
  explicit RodSample(const model::SlungLoadState& state)
      : rod(state.rod), p_QL_W(state.p_WL - state.p_WQ), v_QL_W(state.v_WL - state.v_WQ) {}

  model::RodAngles rod;
  Eigen::Vector3d p_QL_W, v_QL_W;  // from the quadrotor to the load
};

class SensedPlant : public Plant {
 public:
  SensedPlant(std::unique_ptr<Plant> plant, const PlantSetup& setup, const config::Sensing& sensing,
              bool sees_truth)
      : plant_(std::move(plant)),
        vehicles_(setup.vehicles),
        estimator_(setup.estimator),
        sees_truth_(sees_truth),
        delay_steps_(calc_delay_steps(sensing.node_delay_ns, setup.plant.step_ns)),
        body_(SampleClock(sensing.body, setup.plant.step_ns), *plant_, vehicles_.size()),
        rod_(SampleClock(sensing.rod, setup.plant.step_ns), *plant_, vehicles_.size()),
        seen_(vehicles_.size()) {
    see();
  }

  void advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) override {
    for (const Eigen::Vector3d& force : f_Q_W)  // refused here, not when it begins to act
      check_finite(force, step_, "force_x_n", "force_y_n", "force_z_n");
    if (steps <= 0) return;
    under_way_.put(step_, f_Q_W);
    for (const std::int64_t end = step_ + steps; step_ < end;) {
      const std::vector<Eigen::Vector3d>& acting = under_way_.take(step_ - delay_steps_);
      std::int64_t stop = std::min({end, body_.next_step(), rod_.next_step()});
      if (const auto next = under_way_.find_next()) stop = std::min(stop, *next + delay_steps_);
      plant_->advance(acting, stop - step_);
      step_ = stop;
      body_.sample(*plant_, step_);
      rod_.sample(*plant_, step_);
    }
    see();
  }

  const model::Measurement& measurement(std::size_t vehicle) const override {
    return plant_->measurement(vehicle);
  }
  const model::Measurement& seen(std::size_t vehicle) const override { return seen_[vehicle]; }
  bool sees_truth() const override { return sees_truth_; }
  std::vector<std::string> take_remarks(std::size_t vehicle) override {
    return plant_->take_remarks(vehicle);
  }
  bool has_attitude() const override { return plant_->has_attitude(); }
  std::vector<Signal> signals() const override { return plant_->signals(); }

 private:
  model::Measurement add_errors(const model::Measurement& state, double rod_length) const {
    model::StateOffset offset;
    offset.position = estimator_.position;
    offset.velocity = estimator_.velocity;
    model::Measurement wrong = model::add(state, offset, rod_length);
    if (!estimator_.attitude.is_zero())
      wrong.attitude.q_WB = model::turn(state.attitude.q_WB, estimator_.attitude);
    return wrong;
  }

  void see() {
    const bool is_one_time = body_.find_seen(step_) == rod_.find_seen(step_);
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      model::Measurement seen = body_.show(*plant_, i, step_);
      const RodSample rod = rod_.show(*plant_, i, step_);
      if (!is_one_time) {  // if it is, `seen` stays that state bit for bit
        seen.rod = rod.rod;
        seen.p_WL = seen.p_WQ + rod.p_QL_W;
        seen.v_WL = seen.v_WQ + rod.v_QL_W;
      }
      if (!is_exact(estimator_)) seen = add_errors(seen, vehicles_[i].parameters.rod_length);
      seen_[i] = seen;
    }
  }

  const std::unique_ptr<Plant> plant_;
  const std::vector<PlantSetup::Vehicle> vehicles_;
  const config::Estimator estimator_;
  const bool sees_truth_;
  const std::int64_t delay_steps_;  // of the forces
  std::int64_t step_ = 0;
  DelayLine<std::vector<Eigen::Vector3d>> under_way_;  // forces that were handed over
  SensorGroup<model::Measurement> body_;
  SensorGroup<RodSample> rod_;
  std::vector<model::Measurement> seen_;
};

}  // namespace

std::unique_ptr<Plant> make_sensed(std::unique_ptr<Plant> plant, const PlantSetup& setup,
                                   const config::Scenario& scenario) {
  const config::Sensing& sensing = scenario.sensing;
  const std::int64_t period_ns = scenario.sync.period_ns;
  const bool sees_truth = is_exact(setup.estimator) && !is_ever_old(sensing.body, period_ns) &&
                          !is_ever_old(sensing.rod, period_ns);
  if (sees_truth && sensing.node_delay_ns == 0) return plant;
  return std::make_unique<SensedPlant>(std::move(plant), setup, sensing, sees_truth);
}

}  // namespace sls::sim
