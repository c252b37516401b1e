/// Translates exceptions of C++ into exceptions of Python, with the texts that the programs print.
#pragma once

#include <pybind11/pybind11.h>

#include <string>

namespace sls::python {

/// Registers the translation for the whole module:
/// config::ConfigError → sls.ConfigError (a ValueError), std::system_error → OSError with errno,
/// app::RunError and record::DamagedError → sls.RunError (a RuntimeError). Must be called before
/// the other parts are added.
void add_errors(pybind11::module_& module);

/// The classes of sls/errors.py, as borrowed references. The caller must hold the GIL.
pybind11::handle config_error_type();
pybind11::handle run_error_type();
pybind11::handle law_fault_type();

/// Runs Python's handlers of the signals that have arrived, such as Ctrl-C. The caller must hold
/// the GIL.
/// @throws pybind11::error_already_set with the exception of a handler, such as KeyboardInterrupt.
void check_signals();

}  // namespace sls::python
