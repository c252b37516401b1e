#include "sim_server/plants/cables/cables_plant.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <utility>

namespace sls::sim {
namespace {

constexpr int kMostRemarks = 20;  // of a vehicle

const std::vector<PlantSetup::Vehicle>& check_vehicles(const PlantSetup& setup) {
  const std::string defect =
      find_count_defect(setup.plant.own.get<CablesKeys>(), setup.vehicles.size());
  if (!defect.empty()) throw config::ConfigError("plant.cables: " + defect);
  return setup.vehicles;
}

std::string describe_time(double time) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9f s", time);
  return text;
}

}  // namespace

CablesPlant::CablesPlant(const PlantSetup& setup)
    : CablesPlant(setup,
                  cables::make_start(setup.plant.own.get<CablesKeys>(), check_vehicles(setup))) {}

CablesPlant::CablesPlant(const PlantSetup& setup, const cables::Start& start)
    : system_(start.system),
      step_s_(1e-9 * static_cast<double>(setup.plant.step_ns)),
      motion_(start.system, start.motion),
      remarks_(setup.vehicles.size()),
      remark_counts_(setup.vehicles.size()) {
  actions_.air = setup.plant.air;
  actions_.disturbance_W = setup.plant.disturbance_W;
  for (std::size_t i = 0; i < system_.count; ++i) {
    measurements_.push_back(measure(i));
    check_finite(measurements_[i], 0);
  }
}

void CablesPlant::advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) {
  for (std::size_t i = 0; i < system_.count; ++i) {
    check_finite(f_Q_W[i], steps_, "force_x_n", "force_y_n", "force_z_n");
    actions_.f_Q_W[i] = f_Q_W[i];
  }
  for (std::int64_t k = 0; k < steps; ++k) {
    events_.clear();
    motion_.step(actions_, step_s_, events_);
    for (const cables::Event& event : events_) note(event);
    ++steps_;
  }
  for (std::size_t i = 0; i < system_.count; ++i) {
    const model::Measurement measured = measure(i);
    check_finite(measured, steps_);
    measurements_[i] = measured;
  }
}

model::Measurement CablesPlant::measure(std::size_t vehicle) const {
  const cables::Motion& motion = motion_.motion();
  const cables::Vehicle& own = motion.vehicles[vehicle];
  const Eigen::Vector4d& q = motion.q_WL;
  Eigen::Vector3d p_LE_W(0.0, 0.0, 0.0), v_LE_W(0.0, 0.0, 0.0);
  if (system_.is_rigid) {
    const Eigen::Matrix3d R_WL = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
    p_LE_W = R_WL * system_.attachment_L[vehicle];
    v_LE_W = R_WL * motion.w_WL_L.cross(system_.attachment_L[vehicle]);
  }
  model::SlungLoadState state;
  state.p_WQ = own.p_W;
  state.v_WQ = own.v_W;
  state.p_WL = motion.p_WL + p_LE_W;
  state.v_WL = motion.v_WL + v_LE_W;
  const Eigen::Vector3d d_W = state.p_WL - state.p_WQ, drift_W = state.v_WL - state.v_WQ;
  const double distance = std::sqrt(d_W.squaredNorm());
  if (distance > 0.0) {  // else the cable has no direction, and hangs
    const Eigen::Vector3d n_W = d_W / distance;
    state.rod = model::to_angles({n_W, (drift_W - n_W * n_W.dot(drift_W)) / distance});
  }
  model::Measurement measured(state);
  measured.signals.resize(10);
  measured.signals << motion_.tension()[vehicle], own.length, motion_.taut().has(vehicle) ? 1 : 0,
      q[0], q[1], q[2], q[3], motion.w_WL_L.x(), motion.w_WL_L.y(), motion.w_WL_L.z();
  return measured;
}

std::vector<Signal> CablesPlant::signals() const {
  return {{"cable_tension_n", "N"},
          {"cable_length_m", "m"},
          {"cable_taut", ""},
          {"load_att_w", ""},
          {"load_att_x", ""},
          {"load_att_y", ""},
          {"load_att_z", ""},
          {"load_rate_x_rad_s", "rad/s"},
          {"load_rate_y_rad_s", "rad/s"},
          {"load_rate_z_rad_s", "rad/s"}};
}

void CablesPlant::note(const cables::Event& event) {
  int& count = remark_counts_[event.cable];
  std::vector<std::string>& remarks = remarks_[event.cable];
  if (++count > kMostRemarks) return;
  const std::string time =
      " at " + describe_time(static_cast<double>(steps_) * step_s_ + event.time);
  using Kind = cables::Event::Kind;
  if (event.kind == Kind::kStuck) {
    remarks.push_back("cable: too many events in one step" + time +
                      "; taut cables stay taut until its end");
  } else if (event.kind == Kind::kSlack) {
    remarks.push_back("cable slack" + time +
                      (motion_.taut().empty() ? "; no cable carries the load" : ""));
  } else {
    char impulse[32];
    std::snprintf(impulse, sizeof impulse, "%.6g N s", event.impulse);
    remarks.push_back("cable taut" + time + ", impulse " + impulse);
  }
  if (count == kMostRemarks) remarks.push_back("cable: no further remark on it");
}

std::vector<std::string> CablesPlant::take_remarks(std::size_t vehicle) {
  return std::exchange(remarks_[vehicle], {});
}

PlantType cables_type() {
  return {Moves::kAllVehicles, [](const PlantSetup& setup) -> std::unique_ptr<Plant> {
            return std::make_unique<CablesPlant>(setup);
          }};
}

}  // namespace sls::sim
