/// The parts of the extension module, each in a file of its name.
#pragma once

#include <pybind11/pybind11.h>

namespace sls::python {

// --- errors.cpp: exceptions of C++ as exceptions of Python, with the texts that the programs print

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

// --- the other parts

void add_scenario(pybind11::module_& module);
void add_flight(pybind11::module_& module);
void add_measures(pybind11::module_& module);
void add_recording(pybind11::module_& module);
void add_campaign(pybind11::module_& module);
void add_batch(pybind11::module_& module);
void add_client(pybind11::module_& module);
void add_cables(pybind11::module_& module);

}  // namespace sls::python
