/// A scenario that Python hands over.
#pragma once

#include <pybind11/pybind11.h>

#include "common/config/scenario.hpp"

namespace sls::python {

/// The scenario of an object with the attributes `text` and `folder`, such as sls.Scenario: read
/// anew from its text, so that it has the same hash.
/// @throws config::ConfigError as reading that text does, or where it is no such object.
inline config::Scenario read_scenario_argument(const pybind11::object& object) {
  namespace py = pybind11;
  if (!py::hasattr(object, "text") || !py::hasattr(object, "folder"))
    throw config::ConfigError(
        "scenario: expected one of sls.load_scenario or the path of a file, got " +
        std::string(py::str(py::type::handle_of(object).attr("__name__"))));
  const std::string place =
      py::hasattr(object, "name") ? std::string(py::str(object.attr("name"))) : "scenario";
  config::Scenario scenario =
      config::parse_scenario(std::string(py::str(object.attr("text"))), place);
  scenario.folder = std::string(py::str(object.attr("folder")));
  return scenario;
}

}  // namespace sls::python
