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

/// The class `name` of sls/errors.py, as a borrowed reference. The caller must hold the GIL. The
/// classes are defined in Python, because code that runs without this module raises them, too.
pybind11::handle find_error_type(const char* name);

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
