#include "python/bindings/bindings.hpp"

#include <pybind11/gil.h>

#include <exception>
#include <system_error>

#include "common/app/run_main.hpp"
#include "common/config/config_error.hpp"
#include "recorder/sinks/csv/csv_reader.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;

/// The class `name` of sls/errors.py. The classes are defined in Python, because code that runs
/// without this module raises them, too.
py::handle find_type(const char* name) {
  static const py::handle module = py::module_::import("sls.errors").release();
  return py::object(module.attr(name)).release();  // never freed
}

void raise_os_error(const std::system_error& error) {
  // The text, which has the place and the cause, is the only argument: with two arguments Python
  // would print [Errno …] before it.
  const py::object raised = py::handle(PyExc_OSError)(error.what());
  raised.attr("errno") = error.code().value();
  PyErr_SetObject(PyExc_OSError, raised.ptr());
}

void translate(std::exception_ptr thrown) {
  if (!thrown) return;
  try {
    std::rethrow_exception(thrown);
  } catch (const config::ConfigError& error) {
    PyErr_SetString(config_error_type().ptr(), error.what());
  } catch (const std::system_error& error) {
    raise_os_error(error);
  } catch (const app::RunError& error) {
    PyErr_SetString(run_error_type().ptr(), error.what());
  } catch (const record::DamagedError& error) {
    PyErr_SetString(run_error_type().ptr(), error.what());
  }
}

}  // namespace

py::handle config_error_type() {
  static const py::handle type = find_type("ConfigError");
  return type;
}

py::handle run_error_type() {
  static const py::handle type = find_type("RunError");
  return type;
}

py::handle law_fault_type() {
  static const py::handle type = find_type("LawFault");
  return type;
}

void check_signals() {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

void add_errors(py::module_& module) {
  module.attr("ConfigError") = config_error_type();
  module.attr("RunError") = run_error_type();
  py::register_local_exception_translator(translate);
}

}  // namespace sls::python
