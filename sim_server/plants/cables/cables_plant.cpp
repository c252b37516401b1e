#include "sim_server/plants/cables/cables_plant.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/config/numbers.hpp"
#include "common/model/dot.hpp"

namespace sls::sim {
namespace {

constexpr int kMostRemarks = 20;  // of a vehicle on a topic
constexpr const char* kNoneCarries = "; no cable carries the load";
constexpr double kSameTime = 1e-12;  // s: rounding of a time in a scenario

const std::vector<PlantSetup::Vehicle>& check_vehicles(const PlantSetup& setup) {
  const std::string defect =
      find_count_defect(setup.plant.own.get<CablesKeys>(), setup.vehicles.size());
  if (!defect.empty()) throw config::ConfigError("plant.cables: " + defect);
  return setup.vehicles;
}

std::string describe_time(double time) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, time, std::chars_format::fixed, 9);
  return std::string(text, end.ptr) + " s";
}

}  // namespace

CablesPlant::CablesPlant(const PlantSetup& setup)
    : CablesPlant(setup,
                  cables::make_start(setup.plant.own.get<CablesKeys>(), check_vehicles(setup))) {}

CablesPlant::CablesPlant(const PlantSetup& setup, const cables::Start& start)
    : system_(start.system),
      air_(setup.plant),
      step_s_(1e-9 * static_cast<double>(setup.plant.step_ns)),
      motion_(start.system, start.motion),
      phases_(setup.vehicles.size()),
      remarks_(setup.vehicles.size()),
      remark_counts_(setup.vehicles.size()),
      named_step_ns_(setup.plant.step_ns) {
  actions_.air = setup.plant.air;
  actions_.load_drag = setup.plant.load_drag;
  actions_.load_wind_W = setup.plant.air.v_wind_W;
  if (air_.varies()) actions_.v_wind_W = &v_wind_W_;
  actions_.disturbance_W = setup.plant.disturbance_W;
  if (const auto& airframe = setup.plant.own.get<CablesKeys>().airframe) {
    rotors_.emplace(*airframe, setup, motion_);
    actions_.propulsion = &*rotors_;
  }
  plan(setup.plant.own.get<CablesKeys>());
  signals_ = list_signals();
  own_signals_ = static_cast<Eigen::Index>(signals_.size());
  air_.list_signals(signals_);
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
    fly_step();
    ++steps_;
  }
  for (std::size_t i = 0; i < system_.count; ++i) {
    const model::Measurement measured = measure(i);
    check_finite(measured, steps_);
    measurements_[i] = measured;
  }
}

void CablesPlant::plan(const CablesKeys& keys) {
  for (std::size_t i = 0; i < keys.cables.size(); ++i) {
    const CableKeys& cable = keys.cables[i];
    if (cable.winch) {
      has_winch_ = true;
      double length = motion_.motion().vehicles[i].length;
      for (const WinchStageKeys& stage : cable.winch->stages) {
        const std::vector<cables::WinchPhase> phases = cables::make_phases(stage, length);
        for (const cables::WinchPhase& phase : phases) {
          std::string remark;
          if (phase.start == phases.back().start)
            remark = "winch stops at " + config::to_text(stage.length) + " m";
          else if (phase.start == phases.front().start)
            remark = "winch starts towards " + config::to_text(stage.length) + " m";
          changes_.push_back({phase.start, i, phase, remark});
        }
        length = stage.length;
      }
    }
    has_stretch_ |= cable.stiffness.has_value();
    if (cable.release_ns) {
      has_release_ = true;
      changes_.push_back({1e-9 * static_cast<double>(*cable.release_ns), i, {}, "cable released"});
    }
  }
  std::stable_sort(changes_.begin(), changes_.end(),
                   [](const Change& a, const Change& b) { return a.time < b.time; });
}

/// A step of the plant, in parts where something changes inside it.
void CablesPlant::fly_step() {
  const double start = static_cast<double>(steps_) * step_s_;
  if (air_.varies()) hold_wind(start);
  if (rotors_) rotors_->begin_step(actions_.f_Q_W, steps_, motion_);
  for (double flown = 0.0; flown < step_s_;) {
    double until = step_s_;
    for (; next_change_ < changes_.size(); ++next_change_) {
      const Change& change = changes_[next_change_];
      if (change.time > start + flown + kSameTime) {
        if (change.time < start + step_s_ - kSameTime) until = change.time - start;
        break;
      }
      apply(change);
    }
    for (std::size_t i = 0; i < phases_.size(); ++i) {
      if (!phases_[i]) continue;
      const cables::WinchLength now = cables::calc_length(*phases_[i], start + flown);
      motion_.set_length(i, now.length, now.rate);
    }
    events_.clear();
    motion_.step(actions_, until - flown, events_);
    for (cables::Event& event : events_) {
      event.time += flown;
      note(event);
    }
    flown = until;
  }
  if (motion_.energy_error() > cables::HybridMotion::kCoarse) judge_step();
  if (rotors_) rotors_->end_step(motion_);
}

/// The wind over the step that begins at `start`, s.
void CablesPlant::hold_wind(double start) {
  const cables::Motion& motion = motion_.motion();
  for (std::size_t i = 0; i < system_.count; ++i)
    v_wind_W_[i] =
        air_.calc_held_wind(start, step_s_, motion.vehicles[i].p_W, motion.vehicles[i].v_W);
  actions_.load_wind_W = air_.calc_held_wind(start, step_s_, motion.p_WL, motion.v_WL);
  if (rotors_) rotors_->set_wind(v_wind_W_);
}

/// Names a step that is too coarse: once, and again when only half of the named step would do.
void CablesPlant::judge_step() {
  constexpr double kAimed = 0.25 * cables::HybridMotion::kCoarse;
  const double error = motion_.energy_error();
  const std::int64_t step_ns = std::llround(1e9 * step_s_);
  std::int64_t fine_ns = step_ns;
  for (double left = error; left > kAimed && 1024 * fine_ns > step_ns; left /= 16.0) fine_ns /= 2;
  const auto show = [](std::int64_t ns) {
    return config::to_text(static_cast<double>(ns) / 1e9) + " s";
  };
  const std::string when = describe_time(static_cast<double>(steps_ + 1) * step_s_);
  if (error > cables::HybridMotion::kWrong)
    throw std::runtime_error("plant.step_s: expected at most " + show(fine_ns) +
                             " for the motion at " + when + ", got " + show(step_ns) +
                             ", with which the flight is wrong");
  if (fine_ns >= named_step_ns_) return;
  named_step_ns_ = fine_ns;
  remark(0, Topic::kStep,
         "plant.step_s of " + show(step_ns) + " too coarse for the motion at " + when + "; " +
             show(fine_ns) + " would do");
}

void CablesPlant::apply(const Change& change) {
  if (change.phase) {
    phases_[change.cable] = change.phase;
    actions_.length_acceleration[change.cable] = change.phase->acceleration;
  } else {
    motion_.cut(change.cable);
  }
  if (!change.remark.empty())
    remark(change.cable, Topic::kPlan,
           change.remark + " at " + describe_time(change.time) +
               (!change.phase && motion_.taut().empty() ? kNoneCarries : ""));
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
  if (distance > 0.0 && !motion_.is_cut(vehicle)) {  // else the cable has no end there, and hangs
    const Eigen::Vector3d n_W = d_W / distance;
    state.rod = model::to_angles({n_W, (drift_W - n_W * model::dot(n_W, drift_W)) / distance});
    if (n_W.y() == 0.0 && n_W.z() == 0.0) state.rod.alpha = state.rod.alpha_dot = 0.0;  // undefined
  }
  model::Measurement measured(state);
  const double tension = motion_.tension()[vehicle];
  const bool is_taut = motion_.taut().has(vehicle);
  Eigen::Index count = 0;
  const auto add = [&](double number) { measured.signals[count++] = number; };
  measured.signals.resize(own_signals_);
  for (const double number : {std::max(tension, 0.0), own.length, is_taut ? 1.0 : 0.0, q[0], q[1],
                              q[2], q[3], motion.w_WL_L.x(), motion.w_WL_L.y(), motion.w_WL_L.z()})
    add(number);
  if (has_winch_) add(own.length_rate);
  if (has_release_) add(motion_.is_cut(vehicle));
  if (system_.ground_z_W)
    for (const std::size_t body : {cables::kLoad, vehicle}) add(motion_.standing().has(body));
  if (has_stretch_) {
    const bool is_longer = !motion_.is_cut(vehicle) && distance > own.length;
    add(is_longer ? distance - own.length : 0.0);
  }
  if (rotors_) {
    measured.attitude = cables::to_attitude(motion.turns[vehicle]);
    for (const double number : rotors_->calc_signals(vehicle, motion_, steps_)) add(number);
  }
  air_.add_signals(static_cast<double>(steps_) * step_s_, own.p_W, motion.p_WL, motion.v_WL,
                   measured.signals);
  return measured;
}

/// Signals of a winch, a release and the ground are there if the scenario has them.
std::vector<Signal> CablesPlant::list_signals() const {
  std::vector<Signal> signals = {{"cable_tension_n", "N"},
                                 {"cable_length_m", "m"},
                                 {"cable_taut", ""},
                                 {"load_att_w", ""},
                                 {"load_att_x", ""},
                                 {"load_att_y", ""},
                                 {"load_att_z", ""},
                                 {"load_rate_x_rad_s", "rad/s"},
                                 {"load_rate_y_rad_s", "rad/s"},
                                 {"load_rate_z_rad_s", "rad/s"}};
  if (has_winch_) signals.push_back({"cable_length_rate_m_s", "m/s"});
  if (has_release_) signals.push_back({"cable_released", ""});
  if (system_.ground_z_W)
    for (const char* name : {"load_on_ground", "vehicle_on_ground"}) signals.push_back({name, ""});
  if (has_stretch_) signals.push_back({"cable_stretch_m", "m"});
  if (rotors_)
    for (const Signal& signal : rotors_->of(0).list_signals()) signals.push_back(signal);
  return signals;
}

void CablesPlant::note(const cables::Event& event) {
  using Kind = cables::Event::Kind;
  // The first vehicle tells of the load.
  const bool is_load = event.cable == cables::kLoad;
  const std::size_t vehicle = is_load ? 0 : event.cable;
  const std::string body = is_load ? "load" : "vehicle";
  const std::string time =
      " at " + describe_time(static_cast<double>(steps_) * step_s_ + event.time);
  switch (event.kind) {
    case Kind::kStuck:
      return remark(
          vehicle, Topic::kEvents,
          "cable: too many events in one step" + time + "; taut cables stay taut until its end");
    case Kind::kSlack:
      return remark(vehicle, Topic::kCable,
                    "cable slack" + time + (motion_.taut().empty() ? kNoneCarries : ""));
    case Kind::kTouchDown:
      return remark(vehicle, Topic::kGround, body + " on the ground" + time);
    case Kind::kLiftOff:
      return remark(vehicle, Topic::kGround, body + " lifts off" + time);
    case Kind::kTaut: {
      if (system_.stiffness[vehicle] > 0.0)  // without an impact
        return remark(vehicle, Topic::kCable, "cable taut" + time);
      char impulse[32];
      const auto end = std::to_chars(impulse, impulse + sizeof impulse, event.impulse,
                                     std::chars_format::general, 6);
      return remark(vehicle, Topic::kCable,
                    "cable taut" + time + ", impulse " + std::string(impulse, end.ptr) + " N s");
    }
  }
}

void CablesPlant::remark(std::size_t vehicle, Topic topic, const std::string& text) {
  constexpr const char* kNames[kTopics] = {"plan", "cable", "ground", "too many events", "step_s"};
  const auto index = static_cast<std::size_t>(topic);
  int& count = remark_counts_[vehicle][index];
  if (++count > kMostRemarks) return;
  remarks_[vehicle].push_back(text);
  if (count == kMostRemarks)
    remarks_[vehicle].push_back(std::string(kNames[index]) + ": no further remark on it");
}

std::vector<std::string> CablesPlant::take_remarks(std::size_t vehicle) {
  std::vector<std::string> remarks = std::exchange(remarks_[vehicle], {});
  if (rotors_)
    for (std::string& remark : rotors_->take_remarks(vehicle)) remarks.push_back(std::move(remark));
  return remarks;
}

PlantType cables_type() {
  return {Moves::kAllVehicles, [](const PlantSetup& setup) -> std::unique_ptr<Plant> {
            return std::make_unique<CablesPlant>(setup);
          }};
}

}  // namespace sls::sim
