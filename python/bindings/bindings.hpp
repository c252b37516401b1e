/// The parts of the extension module, each in a file of its name.
#pragma once

#include <pybind11/pybind11.h>

namespace sls::python {

void add_scenario(pybind11::module_& module);
void add_flight(pybind11::module_& module);
void add_measures(pybind11::module_& module);
void add_recording(pybind11::module_& module);
void add_campaign(pybind11::module_& module);
void add_batch(pybind11::module_& module);
void add_client(pybind11::module_& module);
void add_cables(pybind11::module_& module);

}  // namespace sls::python
