/// A control law that is a Python object: what `sls.fly(scenario, controller)` and
/// `sls.Client(controller)` fly with. python/README.md says what such an object is.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <memory>
#include <string>

#include "control_client/laws/control_law.hpp"

namespace sls::python {

/// Errors of the Python laws of a flight: a flight ends with a text, the user is raised the
/// exception itself. Shared by the laws of a flight and the code that flies them. Every member
/// with the GIL alone.
class LawErrors {
 public:
  ~LawErrors();

  /// Keeps the first one: its text, and the exception of Python behind it, which may be none.
  void keep(const std::string& text, pybind11::object cause);

  bool is_empty() const { return text_.empty(); }

  /// Raises sls.RunError with the text, `__cause__` the exception of the law; KeyboardInterrupt and
  /// SystemExit as they are. Does nothing if none is kept.
  /// @throws pybind11::error_already_set
  void raise_first();

 private:
  std::string text_;
  pybind11::object cause_;
};

/// Any thread may call it, with the GIL or without.
class PythonLaw : public control::ControlLaw {
 public:
  /// `has_attitude`: whether attitude and body rates of the plant say anything.
  /// @throws config::ConfigError for an object that cannot be called, or an attribute `memory_size`
  ///   that is no whole number from 0 to 64.
  PythonLaw(const pybind11::object& controller, const control::LawSetup& setup, bool has_attitude,
            std::shared_ptr<LawErrors> errors);
  ~PythonLaw() override;
  PythonLaw(const PythonLaw&) = delete;
  PythonLaw& operator=(const PythonLaw&) = delete;

  /// sls.LawFault of the law becomes the fault of the answer.
  /// @throws std::runtime_error, one line, where the law raises something else or returns no force;
  ///   the exception is then in the errors.
  control::LawOutput calc(const control::LawInput& input) const override;
  int memory_size() const override { return memory_size_; }

 private:
  pybind11::object make_now(const control::LawInput& input) const;
  void read_answer(pybind11::handle answer, control::LawOutput& output) const;

  std::string name_;
  double period_;           // s
  std::int64_t period_ns_;  // the same: times are those of the recording, to the bit
  std::uint32_t vehicle_id_;
  bool has_attitude_;
  int memory_size_ = 0;
  pybind11::object call_;  // what is called: of an instance its method __call__, for speed
  std::shared_ptr<LawErrors> errors_;
};

/// Makes laws of `controller`, which it keeps alive; may be copied and destroyed without the GIL.
control::LawMaker make_python_law_maker(pybind11::object controller, bool has_attitude,
                                        std::shared_ptr<LawErrors> errors);

/// Name of `controller` in messages: of a function or class its name, else that of its type.
std::string name_controller(pybind11::handle controller);

/// Adds the types of what a law is given: sls.Now and sls.Reference.
void add_python_law(pybind11::module_& module);

}  // namespace sls::python
