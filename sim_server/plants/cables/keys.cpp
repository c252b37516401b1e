#include "sim_server/plants/cables/keys.hpp"

#include <algorithm>

#include "common/config/own_keys.hpp"
#include "sim_server/plants/cables/hybrid_motion.hpp"
#include "sim_server/plants/cables/start.hpp"
#include "sim_server/plants/cables/winch.hpp"
#include "sim_server/plants/inertia.hpp"

namespace sls::sim {
namespace {

std::string show(const Eigen::Vector3d& v) {
  return "[" + config::to_text(v.x()) + ", " + config::to_text(v.y()) + ", " +
         config::to_text(v.z()) + "]";
}

/// Of cable, load, winch, release and ground, and of cables that stretch.
std::size_t count_own_signals(const CablesKeys& keys) {
  const bool stretches = std::any_of(keys.cables.begin(), keys.cables.end(),
                                     [](const CableKeys& cable) { return cable.stiffness; });
  return stretches ? 15 : 14;
}

class CablesOwnKeys : public config::OwnKeys<config::Plant, CablesKeys> {
  bool has_attitude(const config::Plant& plant) const override {
    return plant.own.get<CablesKeys>().airframe.has_value();
  }
  std::string find_attitude_key() const override { return "rotors"; }

  config::VehicleShape calc_shape(const config::Plant& plant) const override {
    const auto& airframe = plant.own.get<CablesKeys>().airframe;
    return airframe ? make_shape(airframe->rotors, Eigen::Vector3d::Zero())
                    : config::VehicleShape();
  }

  double calc_swing_rate(const config::Scenario& scenario, std::uint32_t id) const override {
    const auto& keys = scenario.plant.own.get<CablesKeys>();
    Eigen::Vector3d turning = Eigen::Vector3d::Zero();  // of the load, about its axes, 1/s²
    double square = 0.0;
    for (std::uint32_t i = 0; i < scenario.vehicles.size(); ++i) {
      const model::SlungLoadParameters vehicle = make_vehicle_scenario(scenario, i).vehicle;
      const CableKeys cable = get_cable(keys, i);
      double length = vehicle.rod_length;
      if (cable.winch)
        for (const WinchStageKeys& stage : cable.winch->stages)
          length = std::min(length, stage.length);
      if (i == id) square = vehicle.total_mass() * vehicle.gravity / (vehicle.quad_mass * length);
      const Eigen::Array3d squares = cable.attachment.array().square();
      if (keys.load_inertia)
        turning.array() += vehicle.load_mass * vehicle.gravity / keys.load_inertia->array() *
                           ((squares.sum() - squares) / length + std::abs(cable.attachment.z()));
    }
    return std::sqrt(square + turning.maxCoeff());
  }

  /// README.md, "Cables that stretch".
  double calc_spring_rate(const config::Scenario& scenario) const override {
    const auto& keys = scenario.plant.own.get<CablesKeys>();
    double stiffness = 0.0, damping = 0.0, load_mass = 0.0;
    for (const config::VehicleVariant& own : scenario.vehicles)
      load_mass += own.load_mass.value_or(scenario.vehicle.load_mass);
    for (std::size_t i = 0; i < scenario.vehicles.size(); ++i) {
      const CableKeys cable = get_cable(keys, i);
      if (!cable.stiffness) continue;
      double mobility = 1.0 / scenario.vehicles[i].quad_mass.value_or(scenario.vehicle.quad_mass) +
                        1.0 / load_mass;
      if (keys.load_inertia)
        mobility += cable.attachment.squaredNorm() / keys.load_inertia->minCoeff();
      stiffness += *cable.stiffness * mobility;
      damping += cable.damping * mobility;
    }
    return std::max(std::sqrt(stiffness), damping);
  }

  void check(const config::Scenario& scenario, const config::Places& places) const override {
    const auto& keys = scenario.plant.own.get<CablesKeys>();
    const std::size_t count = scenario.vehicles.size();
    if (count > cables::kMaxCables)
      throw places.make_error_at("vehicles", "expected at most " +
                                                 std::to_string(cables::kMaxCables) +
                                                 " on one load, got " + std::to_string(count));
    const std::string defect = find_count_defect(keys, count);
    if (!defect.empty()) throw places.make_error_at("plant.cables", defect);
    check_vehicles(keys, scenario, places);
    check_load(keys, places);
    check_start(keys, scenario, places);
    for (std::size_t i = 0; i < keys.cables.size(); ++i)
      if (keys.cables[i].winch)
        check_winch(*keys.cables[i].winch, "plant.cables[" + std::to_string(i) + "].winch",
                    scenario.vehicles[i].rod_length.value_or(scenario.vehicle.rod_length), places);
  }

  /// Points have no keys of rigid bodies, and those no keys of points; and each lifts its share.
  static void check_vehicles(const CablesKeys& keys, const config::Scenario& scenario,
                             const config::Places& places) {
    if (!keys.airframe) {
      for (const std::string key :
           {"rotor", "inertia_kg_m2", "inertia_products_kg_m2", "disturbance_torque_n_m"})
        if (places.has("plant." + key))
          throw places.make_error_at("plant." + key,
                                     "of vehicles with plant.rotors, here they are point masses");
      return;
    }
    if (scenario.plant.air.rotor_drag != 0.0)
      throw places.make_error_at(
          "plant.rotor_drag_n_s_m",
          "of point masses; the drag of plant.rotors is drag_constant_n_s2_m of plant.rotor");
    check_rotor_signals(scenario, keys.airframe->rotors.size(), count_own_signals(keys), "a cable",
                        places);
    check_airframe(*keys.airframe, places);
    for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id) {
      const model::SlungLoadParameters vehicle = make_vehicle_scenario(scenario, id).vehicle;
      check_inertia(*keys.airframe, vehicle.quad_mass, places);
      check_lift(*keys.airframe, vehicle.total_mass() * vehicle.gravity,
                 "vehicle " + std::to_string(id) + " and its share of the load", places);
    }
  }

  /// Every length fits the drum, and every stage begins after the one before.
  static void check_winch(const WinchKeys& winch, const std::string& path, double length,
                          const config::Places& places) {
    const auto expect = [&](bool holds, const std::string& key, const std::string& expected,
                            double got) {
      if (!holds)
        throw places.make_error_at(path + "." + key,
                                   "expected " + expected + ", got " + config::to_text(got));
    };
    const std::string start = "the cable's length at the start (" + config::to_text(length) + ")";
    expect(winch.min_length <= length, "min_length_m", "at most " + start, winch.min_length);
    expect(winch.max_length >= length, "max_length_m", "at least " + start, winch.max_length);
    double begun = -1.0, ended = 0.0;
    for (std::size_t k = 0; k < winch.stages.size(); ++k) {
      const WinchStageKeys& stage = winch.stages[k];
      const std::string key = "stages[" + std::to_string(k) + "].";
      expect(winch.min_length <= stage.length && stage.length <= winch.max_length, key + "length_m",
             "a length of the drum, " + config::to_text(winch.min_length) + " to " +
                 config::to_text(winch.max_length),
             stage.length);
      const std::vector<cables::WinchPhase> phases = cables::make_phases(stage, length);
      const double at = phases[0].start;
      expect(at > begun, key + "at_s",
             "> " + config::to_text(begun) + ", when the stage before begins", at);
      expect(at >= ended, key + "at_s",
             ">= " + config::to_text(ended) + ", when the stage before ends", at);
      begun = at;
      ended = phases.back().start;
      length = stage.length;
    }
  }

  /// Nothing is inside the ground, and what stands on it is at rest.
  static void check_ground(const CablesKeys& keys, const std::vector<PlantSetup::Vehicle>& vehicles,
                           const config::Places& places) {
    const cables::Motion motion = cables::make_start(keys, vehicles).motion;
    const double z = *keys.ground_z;
    constexpr double kTolerance = cables::HybridMotion::kLengthTolerance;
    const auto stands = [z](const Eigen::Vector3d& p, const Eigen::Vector3d& v) {
      return p.z() >= z - kTolerance && v.z() >= 0.0;
    };
    const auto check_body = [&](const std::string& name, const Eigen::Vector3d& p,
                                const Eigen::Vector3d& v) {
      if (p.z() > z + kTolerance)
        throw places.make_error_at(
            "plant.ground_z_m", "expected at least " + config::to_text(p.z()) + ", the z of " +
                                    name + " at the start (z is down), got " + config::to_text(z));
      if (stands(p, v) && !v.isZero(0.0))
        throw places.make_error_at("plant.initial", "expected " + name +
                                                        " at rest on the ground or rising from it, "
                                                        "got a velocity of " +
                                                        show(v));
    };
    check_body("the load", motion.p_WL, motion.v_WL);
    if (stands(motion.p_WL, motion.v_WL) && !keys.load_rates.isZero(0.0))
      throw places.make_error_at(
          "plant.load_rates_rad_s",
          "expected [0, 0, 0] of a load that stands on the ground, got " + show(keys.load_rates));
    for (std::size_t i = 0; i < vehicles.size(); ++i) {
      const cables::Vehicle& vehicle = motion.vehicles[i];
      check_body("vehicle " + std::to_string(i), vehicle.p_W, vehicle.v_W);
      const Eigen::Vector3d rates = vehicles[i].initial.w_WB_B.value_or(Eigen::Vector3d::Zero());
      if (stands(vehicle.p_W, vehicle.v_W) && !rates.isZero(0.0))
        throw places.make_error_at("plant.initial.body_rates_rad_s",
                                   "expected [0, 0, 0] of a vehicle that stands on the ground, "
                                   "got " +
                                       show(rates));
    }
  }

  std::optional<model::SharedLoad> calc_shared_load(
      const config::Scenario& scenario) const override {
    const auto& keys = scenario.plant.own.get<CablesKeys>();
    model::SharedLoad load;
    if (keys.load_inertia) load.inertia_L = make_inertia(*keys.load_inertia, keys.load_products);
    load.q_WL = keys.load_attitude.value_or(load.q_WL);
    const auto has = [&keys](auto member) {
      return std::any_of(keys.cables.begin(), keys.cables.end(),
                         [&](const CableKeys& cable) { return (cable.*member).has_value(); });
    };
    Eigen::Index place = model::SharedLoad::kSignals + (has(&CableKeys::winch) ? 1 : 0);
    if (has(&CableKeys::release_ns)) load.released = place++;
    if (keys.ground_z) load.on_ground = place;
    load.ground_z_W = keys.ground_z;
    for (std::size_t i = 0; i < scenario.vehicles.size(); ++i)
      load.cables.push_back({scenario.vehicles[i].load_mass.value_or(scenario.vehicle.load_mass),
                             get_cable(keys, i).attachment});
    return load;
  }

  static void check_load(const CablesKeys& keys, const config::Places& places) {
    if (keys.load_inertia) {
      const std::string defect =
          find_free_inertia_defect(make_inertia(*keys.load_inertia, keys.load_products));
      if (!defect.empty()) throw places.make_error_at("plant.load_inertia_kg_m2", defect);
      return;
    }
    for (std::size_t i = 0; i < keys.cables.size(); ++i)
      if (!keys.cables[i].attachment.isZero(0.0))
        throw places.make_error_at(
            "plant.cables[" + std::to_string(i) + "].attachment_m",
            "expected [0, 0, 0] of a load without load_inertia_kg_m2, which is a point, got " +
                show(keys.cables[i].attachment));
    for (const auto& [key, is_there] :
         {std::pair{"load_inertia_products_kg_m2", !keys.load_products.isZero(0.0)},
          std::pair{"load_attitude", keys.load_attitude.has_value()},
          std::pair{"load_rates_rad_s", !keys.load_rates.isZero(0.0)}})
      if (is_there)
        throw places.make_error_at(std::string("plant.") + key,
                                   "of a load with load_inertia_kg_m2, here it is a point");
  }

  /// Every vehicle places the load by its own cable: all at the same point.
  static void check_start(const CablesKeys& keys, const config::Scenario& scenario,
                          const config::Places& places) {
    Eigen::Vector3d of_first;
    std::vector<PlantSetup::Vehicle> vehicles;
    for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id) {
      const config::Scenario alone = config::make_vehicle_scenario(scenario, id);
      const std::string cable = "plant.cables[" + std::to_string(id) + "]";
      const double length = alone.vehicle.rod_length;
      const double distance = get_cable(keys, id).distance.value_or(0.0);
      for (const char* rate : {".alpha_dot_rad_s", ".beta_dot_rad_s"})
        if (id > 0 && alone.plant.initial.has_own_velocity && places.has(cable + rate))
          throw places.make_error_at(
              cable + rate,
              "expected this or vehicles[" + std::to_string(id) + "].quad_velocity_m_s, got both");
      if (!get_cable(keys, id).stiffness && get_cable(keys, id).damping > 0.0)
        throw places.make_error_at(cable + ".damping_n_s_m",
                                   "of a cable with stiffness_n_per_m, this one does not stretch");
      if (distance > length && !get_cable(keys, id).stiffness)
        throw places.make_error_at(cable + ".distance_m", "expected at most the cable's length (" +
                                                              config::to_text(length) + "), got " +
                                                              config::to_text(distance));
      vehicles.push_back({id, alone.vehicle, alone.plant.initial});
      const Eigen::Vector3d centre = cables::calc_load_centre(keys, vehicles.back(), id);
      if (id == 0) of_first = centre;
      constexpr double kRounding = 1e-9;  // m, of the sums in a file
      if ((centre - of_first).norm() > kRounding)
        throw places.make_error_at("vehicles[" + std::to_string(id) + "].offset_m",
                                   "expected an offset that places the load's centre at " +
                                       show(of_first) + " as vehicle 0 does, got " + show(centre));
    }
    if (keys.ground_z) check_ground(keys, vehicles, places);
  }
};

}  // namespace

std::string find_count_defect(const CablesKeys& keys, std::size_t vehicles) {
  if (keys.cables.empty() || keys.cables.size() == vehicles) return "";
  return "expected one for each of " + std::to_string(vehicles) + " vehicles, got " +
         std::to_string(keys.cables.size());
}

const config::ModelKeys<config::Plant>& cables_keys() {
  static const CablesOwnKeys keys;
  return keys;
}

}  // namespace sls::sim
