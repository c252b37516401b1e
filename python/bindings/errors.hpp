/// Errors of C++ as exceptions of Python, with the texts that the programs print.
#pragma once

#include <pybind11/pybind11.h>

#include <string>

namespace sls::python {

/// Registers the translation for the whole module:
/// config::ConfigError → sls.ConfigError (a ValueError), std::system_error → OSError with errno,
/// app::RunError and record::DamagedError → sls.RunError (a RuntimeError). Comes first of all
/// parts.
void add_errors(pybind11::module_& module);

/// The classes of sls/errors.py; borrowed. With the GIL alone.
pybind11::handle config_error_type();
pybind11::handle run_error_type();
pybind11::handle law_fault_type();

/// Runs the handlers of the signals that have arrived, such as that of Ctrl-C. With the GIL alone.
/// @throws pybind11::error_already_set with what a handler raised, such as KeyboardInterrupt.
void check_signals();

}  // namespace sls::python
