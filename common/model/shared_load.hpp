/// A load that several vehicles carry by cables, and its desired attitude.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace sls::model {

struct SharedLoad {
  struct Cable {
    double load_share;             ///< the vehicle's part of the load's mass, kg
    Eigen::Vector3d attachment_L;  ///< in the load, from its centre of mass, m
  };
  /// The first signals of a plant with such a load, in a measurement of one vehicle.
  enum Signal : Eigen::Index {
    kTension = 0,   ///< of the own cable, N
    kLength = 1,    ///< of the own cable, m
    kTaut = 2,      ///< 1, or 0 for a slack cable
    kAttitude = 3,  ///< four numbers: w, x, y, z; rotates vectors from the load into W
    kRates = 7,     ///< three numbers: angular velocity of the load in the load, rad/s
    kSignals = 10
  };

  std::optional<Eigen::Matrix3d> inertia_L;  ///< about the centre of mass, kg·m²; none: a point
  Eigen::Quaterniond q_WL = Eigen::Quaterniond::Identity();  ///< at step 0
  std::vector<Cable> cables;                                 ///< of each vehicle
  /// Further signals, if the plant has them: 1 if the own cable is cut, and if the load stands.
  std::optional<Eigen::Index> released, on_ground;
  std::optional<double> ground_z_W;  ///< m; none: no ground
};

/// The desired attitude of a shared load. It turns about one axis, which is fixed in the load and
/// in W.
struct AttitudeReference {
  Eigen::Matrix3d R_WL = Eigen::Matrix3d::Identity();
  Eigen::Vector3d axis_L = Eigen::Vector3d::UnitZ();
  Eigen::Vector4d turn = Eigen::Vector4d::Zero();  ///< angle's derivatives 1 to 4, rad/s … rad/s⁴
};

}  // namespace sls::model
