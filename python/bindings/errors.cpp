#include "python/bindings/bindings.hpp"

#include <pybind11/gil.h>

#include <exception>
#include <system_error>

#include "common/app/run_error.hpp"
#include "common/config/config_error.hpp"
#include "common/text/printable.hpp"
#include "recorder/sinks/csv/csv_reader.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;

void raise_os_error(const std::system_error& error) {
  // The text, which has the place and the cause, is the only argument: with two arguments Python
  // would print [Errno …] before it.
  const py::object raised = py::handle(PyExc_OSError)(error.what());
  raised.attr("errno") = error.code().value();
  PyErr_SetObject(PyExc_OSError, raised.ptr());
}

/// Controls in the text, which may quote a file, are escaped.
void set_error(const char* name, const std::exception& error) {
  PyErr_SetString(find_error_type(name).ptr(), text::escape_controls(error.what()).c_str());
}

void translate(std::exception_ptr thrown) {
  if (!thrown) return;
  try {
    std::rethrow_exception(thrown);
  } catch (const config::ConfigError& error) {
    set_error("ConfigError", error);
  } catch (const std::system_error& error) {
    raise_os_error(error);
  } catch (const app::RunError& error) {
    set_error("RunError", error);
  } catch (const record::DamagedError& error) {
    set_error("RunError", error);
  }
}

}  // namespace

py::handle find_error_type(const char* name) {
  static const py::handle module = py::module_::import("sls.errors").release();
  return py::object(module.attr(name)).ptr();  // the module owns it
}

void check_signals() {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

void add_errors(py::module_& module) {
  module.attr("ConfigError") = find_error_type("ConfigError");
  module.attr("RunError") = find_error_type("RunError");
  py::register_local_exception_translator(translate);
}

}  // namespace sls::python
