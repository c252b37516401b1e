/// A control law that is a Python object: the argument `controller` of `sls.fly` and `law` of
/// `sls.Client`. python/README.md describes such an object.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <memory>
#include <string>

#include "control_client/laws/control_law.hpp"

namespace sls::python {

/// Errors of the Python laws of a flight, shared by the laws and the code that flies them. The
/// flight ends with a text; this class keeps the exception for the user. The caller of each member
/// function must hold the GIL.
class LawErrors {
 public:
  ~LawErrors();

  /// Keeps the first error: its text, and the Python exception that caused it (empty: none).
  void keep(const std::string& text, pybind11::object cause);

  bool is_empty() const { return text_.empty(); }

  /// Raises the kept error, if there is one: sls.RunError with the text, and with the exception of
  /// the law as `__cause__`. KeyboardInterrupt and SystemExit are raised unchanged.
  /// @throws pybind11::error_already_set
  void raise_first();

 private:
  std::string text_;
  pybind11::object cause_;
};

/// A control law that calls a Python object. Any thread may call it, with or without the GIL.
class PythonLaw : public control::ControlLaw {
 public:
  /// `has_attitude`: the plant has attitude and body rates.
  /// @throws config::ConfigError if the object cannot be called, or if its attribute `memory_size`
  ///   is not a whole number from 0 to 64.
  PythonLaw(const pybind11::object& controller, const control::LawSetup& setup, bool has_attitude,
            std::shared_ptr<LawErrors> errors);
  ~PythonLaw() override;
  PythonLaw(const PythonLaw&) = delete;
  PythonLaw& operator=(const PythonLaw&) = delete;

  /// If the law raises sls.LawFault, the answer has its error code.
  /// @throws std::runtime_error, one line, if the law raises another exception or returns no force.
  ///   `errors` then keeps the exception of the law.
  control::LawOutput calc(const control::LawInput& input) const override;
  int memory_size() const override { return memory_size_; }

 private:
  pybind11::object make_now(const control::LawInput& input) const;
  void read_answer(pybind11::handle answer, control::LawOutput& output) const;

  std::string name_;
  double period_;           // s
  std::int64_t period_ns_;  // the same in ns: gives times equal to the recording's, bit for bit
  std::uint32_t vehicle_id_;
  bool has_attitude_;
  int memory_size_ = 0;
  pybind11::object call_;  // the function, or an instance's bound method __call__, for speed
  std::shared_ptr<LawErrors> errors_;
};

/// Returns a maker of laws that call `controller`. It keeps `controller` alive, and may be copied
/// and destroyed without the GIL.
control::LawMaker make_python_law_maker(pybind11::object controller, bool has_attitude,
                                        std::shared_ptr<LawErrors> errors);

/// Name of `controller` in messages: that of a function or class, otherwise that of its type.
std::string name_controller(pybind11::handle controller);

/// Adds the types of the inputs of a law: sls.Now and sls.Reference.
void add_python_law(pybind11::module_& module);

}  // namespace sls::python
