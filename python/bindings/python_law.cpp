#include "python/bindings/python_law.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/config/config_error.hpp"
#include "python/bindings/bindings.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;
using control::LawInput;
using control::LawOutput;

// --- inputs of a law -----------------------------------------------------------------------------
// Tuples with named fields. All fields are filled before the call: a law reads most of them, and no
// other type is faster.

PyStructSequence_Field kReferenceFields[] = {
    {"position", "Desired position of the load in W, (x, y, z), m."},
    {"velocity", "Its first derivative, m/s."},
    {"acceleration", "Its second derivative, m/s²."},
    {"jerk", "Its third derivative, m/s³."},
    {"snap", "Its fourth derivative, m/s⁴."},
    {nullptr, nullptr}};
PyStructSequence_Desc kReference{"sls.Reference",
                                 "Reference of the load at one instant: five vectors in W.",
                                 kReferenceFields, 5};

PyStructSequence_Field kNowFields[] = {
    {"step", "k, counts control periods from 0."},
    {"time_s", "k × period, s."},
    {"period_s", "Control period in force, s."},
    {"vehicle_id", "Vehicle that the force is for."},
    {"stage", "Index into the mission."},
    {"stage_time_s", "Time since that stage began, s."},
    {"quad_position", "Position of the quadrotor in W, (x, y, z), z down, m."},
    {"quad_velocity", "Velocity of the quadrotor in W, m/s."},
    {"load_position", "Position of the load in W, m."},
    {"load_velocity", "Velocity of the load in W, m/s."},
    {"alpha", "Angle of the rod about x, rad."},
    {"beta", "Angle of the rod about y, rad."},
    {"alpha_rate", "Its rate, rad/s."},
    {"beta_rate", "Its rate, rad/s."},
    {"attitude", "Unit quaternion (w, x, y, z), body to W; None if the plant has no attitude."},
    {"body_rates",
     "Angular velocity in body axes, (x, y, z), rad/s; None if the plant has no attitude."},
    {"signals", "Signals of the plant, in its order; empty if it has none."},
    {"reference", "sls.Reference: desired position of the load and its derivatives."},
    {"memory", "Memory that the law returned at the step before; zeros at step 0."},
    {nullptr, nullptr}};
PyStructSequence_Desc kNow{"sls.Now",
                           "Input of a control law: one vehicle at one step, as plain "
                           "floats, in SI units and radians, and tuples of them.",
                           kNowFields, 19};

PyTypeObject* reference_type = nullptr;
PyTypeObject* now_type = nullptr;

py::object check(PyObject* made) {
  if (!made) throw py::error_already_set();
  return py::reinterpret_steal<py::object>(made);
}

PyObject* make_float(double value) { return PyFloat_FromDouble(value); }

PyObject* make_tuple(const double* values, Py_ssize_t size) {
  PyObject* tuple = PyTuple_New(size);
  for (Py_ssize_t i = 0; tuple && i < size; ++i) PyTuple_SET_ITEM(tuple, i, make_float(values[i]));
  return tuple;
}

PyObject* make_tuple(const Eigen::Vector3d& vector) { return make_tuple(vector.data(), 3); }

PyObject* make_none() {
  Py_INCREF(Py_None);
  return Py_None;
}

py::object make_reference(const model::Reference& reference) {
  const py::object made = check(PyStructSequence_New(reference_type));
  Py_ssize_t i = 0;
  for (const Eigen::Vector3d* vector : {&reference.position, &reference.velocity,
                                        &reference.acceleration, &reference.jerk, &reference.snap})
    PyStructSequence_SET_ITEM(made.ptr(), i++, make_tuple(*vector));
  return made;
}

// --- answers of a law ----------------------------------------------------------------------------

/// `object` as one line of at most 80 bytes, for messages.
std::string to_brief(py::handle object) {
  std::string text = py::repr(object);
  for (char& letter : text)
    if (letter == '\n') letter = ' ';
  return text.size() <= 80 ? text : text.substr(0, 77) + "...";
}

/// Reads `size` finite numbers from a tuple, list or array. For any other object it returns false
/// and sets no Python error.
bool read_numbers(PyObject* object, double* numbers, Py_ssize_t size) {
  if (!PyTuple_Check(object) && !PyList_Check(object)) {
    const py::object list = py::reinterpret_steal<py::object>(PySequence_List(object));
    if (list) return read_numbers(list.ptr(), numbers, size);
    PyErr_Clear();
    return false;
  }
  if (PySequence_Fast_GET_SIZE(object) != size) return false;
  for (Py_ssize_t i = 0; i < size; ++i) {
    numbers[i] = PyFloat_AsDouble(PySequence_Fast_GET_ITEM(object, i));
    if (numbers[i] == -1.0 && PyErr_Occurred()) {
      PyErr_Clear();
      return false;
    }
    if (!std::isfinite(numbers[i])) return false;
  }
  return true;
}

/// The answer of a law is not valid. The text does not name law, vehicle and step.
class BadAnswer : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

model::ErrorCode to_error_code(const std::string& code) {
  if (code == "free_fall") return model::ErrorCode::kFreeFall;
  if (code == "rod_level") return model::ErrorCode::kRodLevel;
  return model::ErrorCode::kNotFinite;
}

std::string describe(const py::error_already_set& error) {
  std::string text = py::str(error.value());
  const std::string type = py::str(error.type().attr("__name__"));
  text = text.substr(0, text.find('\n'));
  return text.empty() ? type : type + ": " + text;
}

int read_memory_size(py::handle controller, const std::string& name) {
  if (!py::hasattr(controller, "memory_size")) return 0;
  const py::object size = controller.attr("memory_size");
  const long number = PyLong_Check(size.ptr()) ? PyLong_AsLong(size.ptr()) : -1;
  PyErr_Clear();  // the error of a number that does not fit in a long
  if (number < 0 || number > model::kMaxNumbers)
    throw config::ConfigError(name + ".memory_size: expected a whole number from 0 to " +
                              std::to_string(model::kMaxNumbers) + ", got " + to_brief(size));
  return static_cast<int>(number);
}

py::object find_call(const py::object& controller) {
  if (PyFunction_Check(controller.ptr()) || PyMethod_Check(controller.ptr())) return controller;
  py::object method = py::getattr(controller, "__call__");
  return PyMethod_Check(method.ptr()) ? method : controller;
}

}  // namespace

// --- errors --------------------------------------------------------------------------------------

LawErrors::~LawErrors() {
  const py::gil_scoped_acquire gil;
  cause_ = py::object();
}

void LawErrors::keep(const std::string& text, py::object cause) {
  if (!is_empty()) return;
  text_ = text;
  cause_ = std::move(cause);
}

void LawErrors::raise_first() {
  if (is_empty()) return;
  if (cause_ && !PyErr_GivenExceptionMatches(cause_.ptr(), PyExc_Exception)) {
    // Ctrl-C and exit() are not the law's fault.
    PyErr_SetObject(py::type::handle_of(cause_).ptr(), cause_.ptr());
    throw py::error_already_set();
  }
  const py::object raised = find_error_type("RunError")(text_);
  if (cause_) raised.attr("__cause__") = cause_;
  PyErr_SetObject(find_error_type("RunError").ptr(), raised.ptr());
  throw py::error_already_set();
}

// --- the law -------------------------------------------------------------------------------------

PythonLaw::PythonLaw(const py::object& controller, const control::LawSetup& setup,
                     bool has_attitude, std::shared_ptr<LawErrors> errors)
    : period_(setup.period),
      period_ns_(std::llround(setup.period * 1e9)),
      vehicle_id_(setup.vehicle_id),
      has_attitude_(has_attitude),
      errors_(std::move(errors)) {
  const py::gil_scoped_acquire gil;
  name_ = name_controller(controller);
  if (!PyCallable_Check(controller.ptr()) || PyType_Check(controller.ptr()))
    throw config::ConfigError(
        "controller: expected an object that can be called with sls.Now, "
        "got " +
        to_brief(controller));
  memory_size_ = read_memory_size(controller, name_);
  call_ = find_call(controller);
}

PythonLaw::~PythonLaw() {
  const py::gil_scoped_acquire gil;
  call_ = py::object();
}

LawOutput PythonLaw::calc(const LawInput& input) const {
  const py::gil_scoped_acquire gil;
  const auto fail = [&](const std::string& text, py::object cause) {
    const std::string line = name_ + ": vehicle " + std::to_string(vehicle_id_) + ", step " +
                             std::to_string(input.step) + ": " + text;
    errors_->keep(line, std::move(cause));
    throw std::runtime_error(line);
  };
  LawOutput output;
  try {
    const py::object now = make_now(input);
    read_answer(check(PyObject_CallOneArg(call_.ptr(), now.ptr())), output);
  } catch (const BadAnswer& error) {
    fail(error.what(), py::object());
  } catch (py::error_already_set& error) {
    // The memory keeps its size: all answers to a sample must have the same size.
    output.memory.setZero(memory_size_);
    if (error.matches(find_error_type("LawFault"))) {
      output.error_code = to_error_code(py::str(error.value().attr("code")));
      return output;
    }
    if (error.trace()) PyException_SetTraceback(error.value().ptr(), error.trace().ptr());
    fail(describe(error), error.value());
  }
  return output;
}

py::object PythonLaw::make_now(const LawInput& input) const {
  const py::object now = check(PyStructSequence_New(now_type));
  const model::Measurement& state = input.state;
  Py_ssize_t i = 0;
  const auto add = [&](PyObject* value) { PyStructSequence_SET_ITEM(now.ptr(), i++, value); };
  add(PyLong_FromUnsignedLongLong(input.step));
  add(make_float(static_cast<double>(static_cast<std::int64_t>(input.step) * period_ns_) / 1e9));
  add(make_float(period_));
  add(PyLong_FromUnsignedLong(vehicle_id_));
  add(PyLong_FromUnsignedLong(input.stage));
  add(make_float(input.stage_time));
  add(make_tuple(state.p_WQ));
  add(make_tuple(state.v_WQ));
  add(make_tuple(state.p_WL));
  add(make_tuple(state.v_WL));
  add(make_float(state.rod.alpha));
  add(make_float(state.rod.beta));
  add(make_float(state.rod.alpha_dot));
  add(make_float(state.rod.beta_dot));
  if (has_attitude_) {
    const Eigen::Quaterniond& q = state.attitude.q_WB;
    const double wxyz[] = {q.w(), q.x(), q.y(), q.z()};
    add(make_tuple(wxyz, 4));
    add(make_tuple(state.attitude.w_WB_B));
  } else {
    add(make_none());
    add(make_none());
  }
  add(make_tuple(state.signals.data(), state.signals.size()));
  add(make_reference(input.reference).release().ptr());
  add(make_tuple(input.memory.data(), input.memory.size()));
  if (PyErr_Occurred()) throw py::error_already_set();  // out of memory
  return now;
}

void PythonLaw::read_answer(py::handle answer, LawOutput& output) const {
  PyObject* force = answer.ptr();
  output.memory.resize(memory_size_);
  if (memory_size_ > 0) {
    if (!PyTuple_Check(answer.ptr()) || PyTuple_GET_SIZE(answer.ptr()) != 2)
      throw BadAnswer("expected (force, memory), for memory_size is " +
                      std::to_string(memory_size_) + ", got " + to_brief(answer));
    force = PyTuple_GET_ITEM(answer.ptr(), 0);
    PyObject* memory = PyTuple_GET_ITEM(answer.ptr(), 1);
    if (!read_numbers(memory, output.memory.data(), memory_size_))
      throw BadAnswer("memory: expected " + std::to_string(memory_size_) + " finite numbers, got " +
                      to_brief(memory));
  }
  if (!read_numbers(force, output.f_Q_W.data(), 3))
    throw BadAnswer("force: expected 3 finite numbers (N), got " + to_brief(force));
}

control::LawMaker make_python_law_maker(py::object controller, bool has_attitude,
                                        std::shared_ptr<LawErrors> errors) {
  const auto drop = [](py::object* held) {
    const py::gil_scoped_acquire gil;
    delete held;
  };
  const std::shared_ptr<py::object> held(new py::object(std::move(controller)), drop);
  return [held, has_attitude, errors = std::move(errors)](const control::LawSetup& setup) {
    return std::make_unique<const PythonLaw>(*held, setup, has_attitude, errors);
  };
}

std::string name_controller(py::handle controller) {
  const py::handle named =
      py::hasattr(controller, "__qualname__") ? controller : py::type::handle_of(controller);
  return py::str(named.attr("__qualname__"));
}

void add_python_law(py::module_& module) {
  reference_type = PyStructSequence_NewType(&kReference);
  now_type = PyStructSequence_NewType(&kNow);
  if (!reference_type || !now_type) throw py::error_already_set();
  module.attr("Reference") = py::handle(reinterpret_cast<PyObject*>(reference_type));
  module.attr("Now") = py::handle(reinterpret_cast<PyObject*>(now_type));
}

}  // namespace sls::python
