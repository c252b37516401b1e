/// Scenarios of design 7 as structs: these tests need no file and no reader.
#pragma once

#include "common/config/scenario.hpp"
#include "control_client/laws/qsf/keys.hpp"

namespace sls::control {

inline constexpr std::int64_t kSecond = 1'000'000'000;

inline config::Stage make_hold(const Eigen::Vector3d& position, std::int64_t duration_ns) {
  config::Stage stage;
  stage.kind = stage.name = "hold";
  stage.reference = config::ConstantReference{position};
  stage.leave = config::LeaveAfter{duration_ns};
  return stage;
}

inline config::Stage make_figure_eight_stage(double offset_z) {
  config::FigureEightReference reference;
  reference.amplitude << 1.5, 0.75, 0.5;
  reference.offset << 0.0, 0.0, offset_z;
  reference.period_s = 16.0;
  config::Stage stage;
  stage.kind = stage.name = "figure_eight";
  stage.reference = reference;
  stage.leave = config::LeaveAfter{32 * kSecond};
  return stage;
}

/// `figure_eight`: two laps from rest, LQR 10 / 5.
inline config::Scenario make_figure_eight(std::int64_t period_ns = 4'000'000) {
  config::Scenario scenario;
  scenario.name = "figure_eight";
  scenario.plant.initial.position << 0.0, 0.0, -0.5;
  scenario.sync.period_ns = period_ns;
  scenario.controller.model.vehicle = scenario.vehicle;
  scenario.mission = {make_figure_eight_stage(-0.5)};
  return scenario;
}

/// `matlab_setpoint_1`: one step of the set-point with the published gains.
inline config::Scenario make_matlab_set_point(std::int64_t period_ns) {
  config::Scenario scenario;
  scenario.name = "matlab_setpoint_1";
  scenario.vehicle.quad_mass = 1.6;
  scenario.vehicle.load_mass = 0.16;
  scenario.vehicle.gravity = 10.0;
  scenario.plant.initial.position << 0.0, 0.0, -1.5;
  scenario.sync.period_ns = period_ns;
  scenario.controller.model.vehicle = scenario.vehicle;
  NamedGains gains;
  gains.vertical.velocity = 7.0711;
  gains.vertical.position = 8.0089;
  gains.horizontal.jerk = 31.623;
  gains.horizontal.acceleration = 77.326;
  gains.horizontal.velocity = 78.729;
  gains.horizontal.position = 34.021;
  scenario.controller.own = QsfKeys{gains};
  scenario.mission = {make_hold({1.0, -1.0, -2.0}, 15 * kSecond)};
  return scenario;
}

/// `gazebo_legacy`: the published plugin's flight, gains in its (reversed) order.
inline config::Scenario make_gazebo_legacy(config::StateWiring wiring) {
  config::Scenario scenario;
  scenario.name = "gazebo_legacy";
  scenario.vehicle = {1.5, 0.201, 1.1, 9.8066};
  scenario.plant.initial.placed = config::Body::kQuadrotor;
  scenario.controller.model.vehicle = {1.5, 0.2, 1.0, 9.8};
  scenario.controller.state_wiring = wiring;
  NamedGains gains;
  gains.vertical.velocity = 2.2361;
  gains.vertical.position = 3.0777;
  gains.horizontal.jerk = 3.1623;
  gains.horizontal.acceleration = 8.4827;
  gains.horizontal.velocity = 9.7962;
  gains.horizontal.position = 5.4399;
  scenario.controller.own = QsfKeys{gains};
  config::LeaveUntil arrival;
  arrival.after_ns = 15 * kSecond;
  arrival.radius_m = 0.2;
  arrival.body = config::Body::kQuadrotor;
  arrival.offset << 0.0, 0.0, -0.95;
  arrival.timeout_ns = 60 * kSecond;
  const auto make_set_point = [&](const Eigen::Vector3d& position) {
    config::Stage stage = make_hold(position, 0);
    stage.kind = stage.name = "set_point";
    stage.leave = arrival;
    return stage;
  };
  scenario.mission = {make_hold({0.0, 0.0, -1.5}, 10 * kSecond),
                      make_set_point({1.0, -1.0, -2.0}),
                      make_set_point({-2.0, -1.0, -4.0}),
                      make_set_point({1.0, 2.0, -3.0}),
                      make_figure_eight_stage(-0.6),
                      make_hold({0.0, 0.0, -1.5}, 15 * kSecond)};
  return scenario;
}

}  // namespace sls::control
