// The mechanics of cables for sls.cables, which checks shapes and signs.
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <Eigen/LU>
#include <optional>
#include <string>
#include <tuple>

#include "common/config/config_error.hpp"
#include "common/config/numbers.hpp"
#include "python/bindings/bindings.hpp"
#include "sim_server/plants/cables/mechanics.hpp"
#include "sim_server/plants/inertia.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;
namespace mechanics = sim::cables;
using Eigen::Vector3d;
using VectorRows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

class Cables {
 public:
  Cables(const std::vector<double>& vehicle_mass, const std::vector<double>& length,
         const VectorRows& attachment, double load_mass,
         const std::optional<Eigen::Matrix3d>& inertia, double gravity, double restitution,
         double tolerance)
      : length_(length), tolerance_(tolerance) {
    system_.count = vehicle_mass.size();
    system_.load_mass = load_mass;
    system_.gravity = gravity;
    system_.restitution = restitution;
    for (std::size_t i = 0; i < system_.count; ++i) {
      system_.vehicle_mass[i] = vehicle_mass[i];
      system_.attachment_L[i] = attachment.row(static_cast<Eigen::Index>(i));
    }
    if (!inertia) return;
    const Eigen::Matrix3d& J = *inertia;
    const std::string defect = J == J.transpose() ? sim::find_free_inertia_defect(J)
                                                  : "expected a symmetric matrix, got another one";
    if (!defect.empty()) throw config::ConfigError("load_inertia_kg_m2: " + defect);
    system_.is_rigid = true;
    system_.inertia_L = J;
    system_.inverse_inertia_L = J.inverse();
  }

  auto calc_accelerations(const Eigen::VectorXd& load, const VectorRows& p_WQ,
                          const VectorRows& v_WQ, const VectorRows& f_Q_W,
                          const std::vector<double>& length_rate,
                          const std::vector<double>& length_acceleration) const {
    const mechanics::Motion motion = to_motion(load, p_WQ, v_WQ, length_rate);
    const mechanics::Geometry geometry = find_geometry(motion);
    mechanics::Actions actions;
    for (std::size_t i = 0; i < system_.count; ++i) {
      actions.f_Q_W[i] = f_Q_W.row(static_cast<Eigen::Index>(i));
      actions.length_acceleration[i] = length_acceleration[i];
    }
    // Ends that approach faster than rounding leave their length.
    const mechanics::Members candidates = mechanics::find_candidates(
        mechanics::Members::all(system_.count), geometry, tolerance_, tolerance_);
    const mechanics::Accelerations found =
        mechanics::calc_accelerations(system_, motion, geometry, actions, candidates);
    std::vector<bool> taut;
    for (std::size_t i = 0; i < system_.count; ++i) taut.push_back(found.taut.has(i));
    const Vector3d turn = system_.is_rigid ? found.rate.w_WL_L : Vector3d(Vector3d::Zero());
    return std::tuple(found.rate.v_WL, turn, to_rows(found.rate), to_list(found.tension), taut);
  }

  auto calc_impact(const Eigen::VectorXd& load, const VectorRows& p_WQ, const VectorRows& v_WQ,
                   const std::vector<double>& length_rate) const {
    mechanics::Motion motion = to_motion(load, p_WQ, v_WQ, length_rate);
    const mechanics::Geometry geometry = find_geometry(motion);
    mechanics::Members at_length;
    for (std::size_t i = 0; i < system_.count; ++i)
      if (geometry.stretch[i] >= -tolerance_) at_length.add(i);
    const mechanics::Vector impulses =
        mechanics::apply_impact(system_, system_.restitution, at_length, motion);
    return std::tuple(motion.v_WL, motion.w_WL_L, to_rows(motion), to_list(impulses));
  }

 private:
  mechanics::Motion to_motion(const Eigen::VectorXd& load, const VectorRows& p_WQ,
                              const VectorRows& v_WQ,
                              const std::vector<double>& length_rate) const {
    mechanics::Motion motion;
    motion.p_WL = load.segment<3>(0);
    motion.v_WL = load.segment<3>(3);
    motion.q_WL = load.segment<4>(6);
    motion.w_WL_L = load.segment<3>(10);
    for (std::size_t i = 0; i < system_.count; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      motion.vehicles[i] = {p_WQ.row(row), v_WQ.row(row), length_[i], length_rate[i]};
    }
    return motion;
  }

  /// @throws config::ConfigError if a cable is longer than it can be.
  mechanics::Geometry find_geometry(const mechanics::Motion& motion) const {
    mechanics::Geometry geometry;
    mechanics::calc_geometry(system_, motion, mechanics::Members::all(system_.count), geometry);
    for (std::size_t i = 0; i < system_.count; ++i)
      if (!(geometry.stretch[i] <= tolerance_))
        throw config::ConfigError("vehicles: expected vehicle " + std::to_string(i) +
                                  " within its cable's length of " + config::to_text(length_[i]) +
                                  " m, got a distance of " +
                                  config::to_text(length_[i] + geometry.stretch[i]) + " m");
    return geometry;
  }

  VectorRows to_rows(const mechanics::Motion& motion) const {
    VectorRows rows(system_.count, 3);
    for (std::size_t i = 0; i < system_.count; ++i)
      rows.row(static_cast<Eigen::Index>(i)) = motion.vehicles[i].v_W;
    return rows;
  }

  std::vector<double> to_list(const mechanics::Vector& vector) const {
    return {vector.begin(), vector.begin() + static_cast<std::ptrdiff_t>(system_.count)};
  }

  mechanics::System system_;
  std::vector<double> length_;
  double tolerance_;
};

}  // namespace

void add_cables(py::module_& module) {
  py::class_<Cables>(module, "Cables")
      .def(py::init<const std::vector<double>&, const std::vector<double>&, const VectorRows&,
                    double, const std::optional<Eigen::Matrix3d>&, double, double, double>(),
           py::arg("vehicle_mass"), py::arg("length"), py::arg("attachment"), py::arg("load_mass"),
           py::arg("inertia"), py::arg("gravity"), py::arg("restitution"), py::arg("tolerance"))
      .def("accelerations", &Cables::calc_accelerations, py::arg("load"), py::arg("p_WQ"),
           py::arg("v_WQ"), py::arg("f_Q_W"), py::arg("length_rate"),
           py::arg("length_acceleration"))
      .def("impact", &Cables::calc_impact, py::arg("load"), py::arg("p_WQ"), py::arg("v_WQ"),
           py::arg("length_rate"));
}

}  // namespace sls::python
