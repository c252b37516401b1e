#include "common/plugin/shared_library.hpp"
#include "python/bindings/bindings.hpp"
#include "python/bindings/python_law.hpp"

PYBIND11_MODULE(_sls_core, module) {
  using namespace sls::python;
  sls::plugin::expects_changes_between_calls = true;
  module.doc() = "The simulator in this process. The package sls is its face.";
  add_errors(module);
  add_python_law(module);
  add_scenario(module);
  add_flight(module);
  add_recording(module);
  add_measures(module);
  add_cables(module);
  add_campaign(module);
  add_batch(module);
  add_client(module);
}
