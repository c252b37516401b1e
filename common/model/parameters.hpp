/// Parameters of a slung load. Symbols and frames: README.md.
#pragma once

#include <Eigen/Core>

namespace sls::model {

/// A quadrotor (point mass) with a load on a rigid, massless rod.
struct SlungLoadParameters {
  double quad_mass = 1.5;   ///< m, kg, > 0
  double load_mass = 0.2;   ///< m_L, kg, > 0
  double rod_length = 1.0;  ///< L, m, > 0
  double gravity = 9.8;     ///< g, m/s², > 0, along +z

  double total_mass() const { return quad_mass + load_mass; }
};

/// The air the quadrotor moves through; zero drag switches it off.
struct Aerodynamics {
  double rotor_drag = 0.0;                             ///< D, N·s/m, ≥ 0
  Eigen::Vector3d v_wind_W = Eigen::Vector3d::Zero();  ///< velocity of the air, m/s
};

/// Drag of the load: −(linear + ½ air_density area |v|) v, with its velocity v through the air.
struct LoadDrag {
  double linear = 0.0;         ///< N·s/m
  double area = 0.0;           ///< with the drag coefficient: c_d A, m²
  double air_density = 1.225;  ///< kg/m³

  bool acts() const { return linear > 0.0 || area > 0.0; }
};

inline bool operator==(const SlungLoadParameters& a, const SlungLoadParameters& b) {
  return a.quad_mass == b.quad_mass && a.load_mass == b.load_mass && a.rod_length == b.rod_length &&
         a.gravity == b.gravity;
}
inline bool operator==(const Aerodynamics& a, const Aerodynamics& b) {
  return a.rotor_drag == b.rotor_drag && a.v_wind_W == b.v_wind_W;
}

}  // namespace sls::model
