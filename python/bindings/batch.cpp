#include "closed_loop/batch.hpp"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <unistd.h>

#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "common/config/numbers.hpp"
#include "python/bindings/bindings.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;
using closed_loop::Batch;
using closed_loop::LoopStart;
using closed_loop::LoopStates;
using Numbers = py::array_t<double, py::array::c_style>;

/// Read-only array on the memory of `data`. The array keeps `owner`, and so the memory, alive.
template <class Number>
py::array make_view(const Number* data, std::vector<py::ssize_t> shape, const py::dtype& type,
                    const py::object& owner) {
  py::array array(type, std::move(shape), data, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

py::ssize_t to_size(std::size_t size) { return static_cast<py::ssize_t>(size); }

/// Shape of an array with `width` numbers for each vehicle: the axis of the vehicles is there if
/// several move together.
std::vector<py::ssize_t> make_shape(const Batch& batch, py::ssize_t width) {
  if (batch.vehicles() == 1) return {to_size(batch.count()), width};
  return {to_size(batch.count()), to_size(batch.vehicles()), width};
}

std::string describe_array(py::handle object) {
  if (!py::isinstance<py::array>(object))
    return py::str(py::type::handle_of(object).attr("__name__"));
  const auto array = py::reinterpret_borrow<py::array>(object);
  const std::string order = (array.flags() & py::array::c_style) ? "" : " that is not C-contiguous";
  return std::string(py::str(array.dtype())) + " of shape " +
         std::string(py::str(array.attr("shape"))) + order;
}

/// Row `row` of an array of initial values.
Eigen::Map<const Eigen::VectorXd> find_row(const Numbers& values, std::size_t row) {
  return {values.data(static_cast<py::ssize_t>(row), 0), values.shape(1)};
}

/// A batch for Python. One thread may call it at a time; the GIL is released while the loops move.
class PythonBatch {
 public:
  PythonBatch(const config::Scenario& scenario, std::size_t count, std::size_t threads,
              std::uint32_t vehicle, const std::string& name) {
    closed_loop::BatchOptions options;
    options.threads = threads;
    options.vehicle = vehicle;
    options.controller_name = name;
    if (vehicle >= scenario.vehicles.size())
      throw config::ConfigError("vehicle: expected a vehicle of the " +
                                std::to_string(scenario.vehicles.size()) + " in '" + scenario.name +
                                "', got " + std::to_string(vehicle));
    const py::gil_scoped_release release;
    batch_ = std::make_unique<Batch>(scenario, count, options);
  }

  const Batch& get() const { return *batch_; }

  void step(const py::object& force) {
    const auto shape = py::tuple(py::cast(make_shape(*batch_, 3)));
    if (!py::isinstance<Numbers>(force) || !shape.equal(force.attr("shape")))
      throw config::ConfigError("force: expected a C-contiguous array of float64 of shape " +
                                py::repr(shape).cast<std::string>() + ", got " +
                                describe_array(force));
    const double* forces = py::reinterpret_borrow<Numbers>(force).data();
    const py::gil_scoped_release release;
    const std::unique_lock lock = take_turn();
    batch_->step(forces);
  }

  Numbers answer() {
    Numbers forces(make_shape(*batch_, 3));
    double* const data = forces.mutable_data();
    const py::gil_scoped_release release;
    const std::unique_lock lock = take_turn();
    batch_->answer(data);
    return forces;
  }

  /// `values`: arrays by name, with a row for each loop in `which`. Other initial values are those
  /// of the scenario.
  void reset(const std::vector<std::size_t>& which, const std::vector<std::uint64_t>& seeds,
             const std::map<std::string, Numbers>& values) {
    std::vector<LoopStart> starts(which.size());
    for (std::size_t k = 0; k < which.size(); ++k) {
      starts[k].initial = batch_->scenario().plant.initial;
      starts[k].seed_shift = seeds[k];
      for (const auto& [name, rows] : values) put(name, find_row(rows, k), starts[k].initial);
    }
    const py::gil_scoped_release release;
    const std::unique_lock lock = take_turn();
    batch_->reset(which, starts);
  }

  /// Position, velocity, acceleration, jerk and snap (each n × vehicles × 3) at `times` (s, n).
  py::tuple calc_reference(const Numbers& times) const {
    const std::size_t vehicles = batch_->vehicles();
    std::vector<Numbers> derivatives;
    for (int i = 0; i < 5; ++i)
      derivatives.emplace_back(std::vector<py::ssize_t>{times.size(), to_size(vehicles), 3});
    for (py::ssize_t row = 0; row < times.size(); ++row) {
      const double time_s = times.data()[row];
      if (!(time_s >= 0.0 && time_s <= config::kMaxSeconds))
        throw config::ConfigError("time_s: expected from 0 to 1000000 s, got " +
                                  std::string(py::str(py::float_(time_s))));
      for (std::size_t k = 0; k < vehicles; ++k) {
        const model::Reference reference = batch_->calc_reference(std::llround(time_s * 1e9), k);
        auto into = derivatives.begin();
        for (const Eigen::Vector3d* vector :
             {&reference.position, &reference.velocity, &reference.acceleration, &reference.jerk,
              &reference.snap})
          Eigen::Map<Eigen::Vector3d>((into++)->mutable_data(row, to_size(k), 0)) = *vector;
      }
    }
    return py::make_tuple(derivatives[0], derivatives[1], derivatives[2], derivatives[3],
                          derivatives[4]);
  }

 private:
  using Row = Eigen::Map<const Eigen::VectorXd>;

  static void put(const std::string& name, const Row& row, config::InitialState& initial) {
    if (name == "quad_position" || name == "load_position") {
      initial.placed = name[0] == 'l' ? config::Body::kLoad : config::Body::kQuadrotor;
      initial.position = row;
    } else if (name == "quad_velocity") {
      initial.v_WQ = row;
    } else if (name == "angles") {
      initial.rod.alpha = row[0];
      initial.rod.beta = row[1];
    } else if (name == "angle_rates") {
      initial.rod.alpha_dot = row[0];
      initial.rod.beta_dot = row[1];
    } else if (name == "attitude") {
      initial.q_WB = Eigen::Quaterniond(row[0], row[1], row[2], row[3]).normalized();
    } else {
      initial.w_WB_B = Eigen::Vector3d(row);
    }
  }

  std::unique_lock<std::mutex> take_turn() {
    if (::getpid() != process_)  // a fork does not copy the threads of the batch
      throw config::ConfigError(
          "ClosedLoop: expected the process that made it, got a fork of that: make one there");
    std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock)
      throw config::ConfigError("ClosedLoop: expected one thread at a time, another is at work");
    return lock;
  }

  std::unique_ptr<Batch> batch_;
  std::mutex mutex_;
  const pid_t process_ = ::getpid();
};

py::dict make_views(const LoopStates& states, const py::object& owner) {
  const Batch& batch = owner.cast<const PythonBatch&>().get();
  py::dict views;
  const auto add = [&](const char* name, const auto& rows) {
    if (rows.size() > 0)
      views[name] =
          make_view(rows.data(), make_shape(batch, rows.cols()), py::dtype::of<double>(), owner);
  };
  add("quad_position", states.quad_position);
  add("quad_velocity", states.quad_velocity);
  add("load_position", states.load_position);
  add("load_velocity", states.load_velocity);
  add("angles", states.angles);
  add("angle_rates", states.angle_rates);
  add("attitude", states.attitude);
  add("body_rates", states.body_rates);
  add("signals", states.signals);
  return views;
}

}  // namespace

void add_batch(py::module_& module) {
  py::class_<PythonBatch>(module, "Batch",
                          "Many loops of one scenario: sls.ClosedLoop is its face.")
      .def(py::init<const config::Scenario&, std::size_t, std::size_t, std::uint32_t,
                    const std::string&>(),
           py::arg("scenario"), py::arg("count"), py::arg("threads"), py::arg("vehicle"),
           py::arg("name"))
      .def("step", &PythonBatch::step, py::arg("force"))
      .def("answer", &PythonBatch::answer)
      .def("reset", &PythonBatch::reset, py::arg("which"), py::arg("seeds"), py::arg("values"))
      .def("calc_reference", &PythonBatch::calc_reference, py::arg("times"))
      .def("failure",
           [](const PythonBatch& batch, std::size_t loop) { return batch.get().failure(loop); })
      .def_property_readonly("truth",
                             [](const py::object& self) {
                               return make_views(self.cast<const PythonBatch&>().get().truth(),
                                                 self);
                             })
      .def_property_readonly("measured",
                             [](const py::object& self) {
                               return make_views(self.cast<const PythonBatch&>().get().measured(),
                                                 self);
                             })
      .def_property_readonly(
          "counters",
          [](const py::object& self) {
            const Batch& batch = self.cast<const PythonBatch&>().get();
            const std::vector<py::ssize_t> shape{to_size(batch.count())};
            py::dict views;
            views["step"] =
                make_view(batch.steps().data(), shape, py::dtype::of<std::uint64_t>(), self);
            views["time_s"] = make_view(batch.times().data(), shape, py::dtype::of<double>(), self);
            views["failed"] =
                make_view(batch.has_failed().data(), shape, py::dtype::of<bool>(), self);
            return views;
          })
      .def_property_readonly(
          "constants",
          [](const PythonBatch& batch) {
            const config::Scenario& scenario = batch.get().scenario();
            const auto of_each = [&](double model::SlungLoadParameters::*value) -> py::object {
              const std::size_t vehicles = batch.get().vehicles();
              if (vehicles == 1) return py::float_(batch.get().own(0).vehicle.*value);
              Numbers values(to_size(vehicles));
              for (std::size_t k = 0; k < vehicles; ++k)
                values.mutable_at(k) = batch.get().own(k).vehicle.*value;
              return values;
            };
            py::dict constants;
            constants["period_s"] = static_cast<double>(scenario.sync.period_ns) / 1e9;
            constants["force_limit_n"] = scenario.controller.force_limit_n;
            constants["quad_mass_kg"] = of_each(&model::SlungLoadParameters::quad_mass);
            constants["load_mass_kg"] = of_each(&model::SlungLoadParameters::load_mass);
            constants["rod_length_m"] = of_each(&model::SlungLoadParameters::rod_length);
            constants["gravity_m_s2"] = scenario.vehicle.gravity;
            return constants;
          })
      .def_property_readonly("signal_names", [](const PythonBatch& batch) {
        py::list names;
        for (const sim::Signal& signal : batch.get().signals()) names.append(signal.name);
        return names;
      });
}

}  // namespace sls::python
