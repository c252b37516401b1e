/// Many loops of one scenario at once, without controllers: the caller gives the forces. For
/// learning and optimisation. Each loop has the same bits as a Flight whose controller returns
/// these forces, for any number of loops and threads.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"
#include "common/model/reference.hpp"
#include "control_client/reference_trajectory.hpp"
#include "sim_server/core/fault_line.hpp"
#include "sim_server/plants/plant.hpp"
#include "sim_server/worker_pool.hpp"

namespace sls::closed_loop {

/// The states of all loops, a row for each: SI, radians, in W.
struct LoopStates {
  using Vectors = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  using Pairs = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;
  using Quaternions = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;

  Vectors quad_position, quad_velocity, load_position, load_velocity;
  Pairs angles, angle_rates;  ///< (alpha, beta) of the rod
  Quaternions attitude;       ///< (w, x, y, z) of q_WB; no rows for plants without attitude
  Vectors body_rates;         ///< w_WB_B; no rows for plants without attitude
};

/// Start of a loop.
struct LoopStart {
  config::InitialState initial;
  std::uint64_t seed_shift = 0;  ///< added to each seed of the scenario's faults
};

struct BatchOptions {
  std::uint32_t vehicle = 0;               ///< of the scenario's fleet; the same in all loops
  std::size_t threads = 1;                 ///< share the work of a step; includes the caller's
  std::string controller_name = "python";  ///< in the texts of `failure`
};

class Batch {
 public:
  /// `count` ≥ 1 loops at step 0 of `scenario`, whose period is the one in force.
  /// @throws config::ConfigError as the plant does.
  Batch(const config::Scenario& scenario, std::size_t count, const BatchOptions& options = {});

  std::size_t count() const { return loops_.size(); }
  std::int64_t period_ns() const { return scenario_.sync.period_ns; }
  /// The scenario of the one vehicle.
  const config::Scenario& scenario() const { return scenario_; }
  bool has_attitude() const { return has_attitude_; }
  /// True if the measured state can differ from the truth.
  bool can_measurement_differ() const { return can_measurement_differ_; }

  /// Resets the loops `which` to step 0, each with its element of `starts`. If it throws, no loop
  /// is reset.
  /// @throws config::ConfigError as the plant does, or for an attitude if the plant has none.
  void reset(const std::vector<std::size_t>& which, const std::vector<LoopStart>& starts);

  /// Moves each loop by one period, with its row of `forces` (count × 3, N, in W) held constant. A
  /// loop fails if the server would refuse its force or if its plant throws; its state then stays
  /// the same until its reset.
  void step(const double* forces);

  const LoopStates& truth() const { return truth_; }
  /// The states after sensors, estimator and faults: the input of controllers.
  const LoopStates& measured() const { return can_measurement_differ_ ? measured_ : truth_; }

  // One entry for each loop.
  const std::vector<std::uint64_t>& steps() const { return steps_; }
  const std::vector<double>& times() const { return times_; }              ///< s
  const std::vector<std::uint8_t>& has_failed() const { return failed_; }  ///< 0 or 1
  /// Reason of the failure, one line; empty if the loop has not failed.
  const std::string& failure(std::size_t loop) const { return loops_[loop].failure; }

  /// The mission's reference `time_ns` after step 0. A stage with a duration ends at its time. A
  /// stage that ends by a radius has no known end, so it counts as the last one.
  model::Reference calc_reference(std::int64_t time_ns) const;

 private:
  struct Loop {
    std::unique_ptr<sim::Plant> plant;
    std::unique_ptr<sim::FaultLine> faults;
    std::vector<Eigen::Vector3d> force;  // the applied force; a member to avoid allocation
    std::string failure;
  };
  struct StageSpan {
    std::int64_t start_ns;
    std::unique_ptr<const control::ReferenceTrajectory> trajectory;
  };

  Loop make_loop(const LoopStart& start) const;
  void move(std::size_t index, const Eigen::Vector3d& f_Q_W);
  /// Copies the state of loop `index` into its rows of truth_ and measured_.
  void show(std::size_t index);
  void fail(std::size_t index, const std::string& reason);

  config::Scenario scenario_;
  const std::uint32_t vehicle_;
  const std::string controller_name_;
  const std::int64_t steps_per_period_;
  bool has_attitude_ = false;
  bool has_state_faults_ = false;
  bool can_measurement_differ_ = false;
  std::vector<StageSpan> stages_;
  std::vector<Loop> loops_;
  LoopStates truth_, measured_;
  std::vector<std::uint64_t> steps_;
  std::vector<double> times_;
  std::vector<std::uint8_t> failed_;
  sim::WorkerPool pool_;
};

}  // namespace sls::closed_loop
