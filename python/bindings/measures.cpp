// The measures of common/model/measures.hpp for arrays: sls.metrics and sls.measures call these.
// Arrays have a row for each step. "Components" are x, y, z and the norm.
#include "common/model/measures.hpp"

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <array>
#include <tuple>
#include <utility>

#include "common/model/invariants.hpp"
#include "python/bindings/bindings.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;
using model::kComponents, model::kNorm;
using Vehicle = model::SlungLoadParameters;
template <int kColumns>
using Rows = Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, kColumns, Eigen::RowMajor>>;
using Vectors = Rows<3>;
using Series = Eigen::Ref<const Eigen::VectorXd>;
using Components = std::array<double, kComponents>;
using Samples = std::array<std::uint64_t, kComponents>;

/// `calc(row)` of each row.
template <class Calc>
Eigen::VectorXd map(Eigen::Index rows, Calc calc) {
  Eigen::VectorXd numbers(rows);
  for (Eigen::Index row = 0; row < rows; ++row) numbers[row] = calc(row);
  return numbers;
}

/// (rms, largest sizes, their samples, sizes at the end)
std::tuple<Components, Components, Samples, Components> calc_errors(const Vectors& errors) {
  model::ErrorStatistics statistics;
  for (Eigen::Index row = 0; row < errors.rows(); ++row) statistics.add(errors.row(row));
  Components rms{}, most{}, end{};
  Samples worst{};
  for (int i = 0; i < kComponents; ++i) {
    const auto at = static_cast<std::size_t>(i);
    rms[at] = statistics.calc_rms(i);
    most[at] = statistics.calc_max(i);
    worst[at] = statistics.find_worst(i);
    end[at] = statistics.calc_end(i);
  }
  return {rms, most, worst, end};
}

/// (settling times, their samples, overshoots, their samples)
std::tuple<Components, Samples, Components, Samples> calc_steps(const Series& time_s,
                                                                const Vectors& errors) {
  model::StepResponses responses;
  for (Eigen::Index row = 0; row < errors.rows(); ++row)
    responses.add(time_s[row], errors.row(row));
  Components settling{}, overshoot{};
  Samples settled{}, furthest{};
  for (int i = 0; i < kComponents; ++i) {
    const auto at = static_cast<std::size_t>(i);
    settling[at] = responses[i].calc_settling_time();
    settled[at] = responses[i].settling().sample();
    overshoot[at] = responses[i].calc_overshoot();
    furthest[at] = responses[i].beyond().sample();
  }
  return {settling, settled, overshoot, furthest};
}

std::pair<double, std::uint64_t> calc_settling(const Series& time_s, const Vectors& errors,
                                               int component, double within_m, double hold_s) {
  model::Settling settling(within_m, hold_s);
  for (Eigen::Index row = 0; row < errors.rows(); ++row)
    settling.add(time_s[row],
                 component == kNorm ? errors.row(row).norm() : std::abs(errors(row, component)));
  return {settling.calc_time(), settling.sample()};
}

std::pair<double, std::uint64_t> find_largest(const Series& numbers) {
  model::Largest largest;
  for (Eigen::Index row = 0; row < numbers.size(); ++row)
    largest.add(numbers[row], static_cast<std::uint64_t>(row));
  return {largest.value(), largest.sample()};
}

Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> calc_quad_reference(
    const Vectors& position, const Vectors& acceleration, const Vehicle& vehicle) {
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> result(position.rows(), 3);
  model::Reference reference;
  for (Eigen::Index row = 0; row < position.rows(); ++row) {
    reference.position = position.row(row);
    reference.acceleration = acceleration.row(row);
    result.row(row) = model::calc_quad_reference(reference, vehicle);
  }
  return result;
}

Eigen::VectorXd calc_energy(const Vectors& p_WQ, const Vectors& v_WQ, const Vectors& p_WL,
                            const Vectors& v_WL, const Vehicle& vehicle) {
  model::SlungLoadState state;
  return map(p_WQ.rows(), [&](Eigen::Index row) {
    state.p_WQ = p_WQ.row(row);
    state.v_WQ = v_WQ.row(row);
    state.p_WL = p_WL.row(row);
    state.v_WL = v_WL.row(row);
    return model::calc_energy(state, vehicle);
  });
}

}  // namespace

void add_measures(py::module_& module) {
  module.def("calc_errors", &calc_errors, py::arg("errors"));
  module.def("calc_steps", &calc_steps, py::arg("time_s"), py::arg("errors"));
  module.def("calc_settling", &calc_settling, py::arg("time_s"), py::arg("errors"),
             py::arg("component"), py::arg("within_m"), py::arg("hold_s"));
  module.def("calc_steady_state_error", &model::calc_steady_state_error, py::arg("time_s"),
             py::arg("errors"));
  module.def("find_largest", &find_largest, py::arg("numbers"));
  module.def("calc_quad_reference", &calc_quad_reference, py::arg("position"),
             py::arg("acceleration"), py::arg("vehicle"));
  module.def("calc_energy", &calc_energy, py::arg("p_WQ"), py::arg("v_WQ"), py::arg("p_WL"),
             py::arg("v_WL"), py::arg("vehicle"));
  module.def(
      "calc_rod_tilt",
      [](const Vectors& p_QL_W) {
        return map(p_QL_W.rows(),
                   [&](Eigen::Index row) { return model::calc_rod_tilt(p_QL_W.row(row)); });
      },
      py::arg("p_QL_W"));
  module.def(
      "calc_body_tilt",
      [](const Rows<4>& wxyz) {
        return map(wxyz.rows(), [&](Eigen::Index row) {
          return model::calc_body_tilt({wxyz(row, 0), wxyz(row, 1), wxyz(row, 2), wxyz(row, 3)});
        });
      },
      py::arg("wxyz"));
}

}  // namespace sls::python
