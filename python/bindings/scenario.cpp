#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "common/config/numbers.hpp"
#include "common/config/scenario.hpp"
#include "common/config/scenario_draft.hpp"
#include "python/bindings/bindings.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;
using config::Scenario;
using Changes = std::vector<std::pair<std::string, std::string>>;

/// Reads a scenario from `file`, or from `text` with paths relative to `folder`. Without changes
/// the scenario has exactly this text.
Scenario make_scenario(const std::optional<std::string>& file, const std::string& text,
                       const std::string& folder, const Changes& changes) {
  if (changes.empty()) {
    if (file) return config::load_scenario(*file);
    Scenario scenario = config::parse_scenario(text, "scenario");
    scenario.folder = folder;
    return scenario;
  }
  config::ScenarioDraft draft = file ? config::ScenarioDraft(std::filesystem::path(*file))
                                     : config::ScenarioDraft(text, "scenario", folder);
  for (const auto& [path, value] : changes) draft.set(path, value);
  return draft.make_scenario();
}

Changes to_changes(const py::dict& dict) {
  Changes changes;
  for (const auto& [path, value] : dict)
    changes.emplace_back(py::cast<std::string>(path), py::cast<std::string>(value));
  return changes;
}

/// A stage as a tuple: kind, name, for_s (s or None), lap_s (s or None).
py::tuple to_stage(const config::Stage& stage) {
  py::object for_s = py::none(), lap_s = py::none();
  if (const auto* after = std::get_if<config::LeaveAfter>(&stage.leave))
    for_s = py::float_(config::to_seconds(after->duration_ns));
  if (const auto* eight = std::get_if<config::FigureEightReference>(&stage.reference))
    lap_s = py::float_(eight->period_s);
  return py::make_tuple(stage.kind, stage.name, for_s, lap_s);
}

}  // namespace

void add_scenario(py::module_& module) {
  py::class_<model::SlungLoadParameters>(module, "Vehicle",
                                         "Masses and rod of one vehicle of a scenario.")
      .def_readonly("quad_mass_kg", &model::SlungLoadParameters::quad_mass)
      .def_readonly("load_mass_kg", &model::SlungLoadParameters::load_mass)
      .def_readonly("rod_length_m", &model::SlungLoadParameters::rod_length)
      .def_readonly("gravity_m_s2", &model::SlungLoadParameters::gravity)
      .def("__repr__", [](const model::SlungLoadParameters& vehicle) {
        return py::str(
                   "Vehicle(quad_mass_kg={!r}, load_mass_kg={!r}, rod_length_m={!r}, "
                   "gravity_m_s2={!r})")
            .format(vehicle.quad_mass, vehicle.load_mass, vehicle.rod_length, vehicle.gravity);
      });

  py::class_<Scenario>(module, "Scenario",
                       "Everything that decides a flight. Made by sls.load_scenario.")
      .def(py::init([](const std::optional<std::string>& file, const std::string& text,
                       const std::string& folder, const py::dict& changes) {
             return make_scenario(file, text, folder, to_changes(changes));
           }),
           py::arg("file") = py::none(), py::arg("text") = "", py::arg("folder") = "",
           py::arg("changes") = py::dict(),
           "A scenario from a file, or from a text whose paths are relative to a folder; changes: "
           "YAML values by path. Raises ConfigError.")
      .def_readonly("text", &Scenario::text, "YAML: a file with this text is the same scenario.")
      .def_readonly("sha256", &Scenario::sha256, "Of the text, 64 lower-case hex digits.")
      .def_readonly("name", &Scenario::name)
      .def_property_readonly(
          "folder", [](const Scenario& scenario) { return scenario.folder.string(); },
          "Paths in the scenario are relative to it.")
      .def_property_readonly(
          "period_s",
          [](const Scenario& scenario) { return config::to_seconds(scenario.sync.period_ns); },
          "Control period, s.")
      .def_property_readonly(
          "step_s",
          [](const Scenario& scenario) { return config::to_seconds(scenario.plant.step_ns); },
          "Integration step of the plant, s.")
      .def_property_readonly(
          "law", [](const Scenario& scenario) { return scenario.controller.law.name; },
          "Name of the control law, or the path of its library.")
      .def_property_readonly(
          "plant", [](const Scenario& scenario) { return scenario.plant.model.name; },
          "Name of the plant, or the path of its library.")
      .def_property_readonly(
          "vehicle", [](const Scenario& scenario) { return scenario.vehicle; },
          "The vehicle; of a fleet what its vehicles have in common.")
      .def_property_readonly(
          "vehicles",
          [](const Scenario& scenario) {
            py::tuple vehicles(scenario.vehicles.size());
            for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id)
              vehicles[id] = py::cast(config::make_vehicle_scenario(scenario, id).vehicle);
            return vehicles;
          },
          "Every vehicle, by id: a tuple of one where there is no fleet.")
      .def_property_readonly(
          "controller_model",
          [](const Scenario& scenario) { return scenario.controller.model.vehicle; },
          "The vehicle parameters that the controller uses.")
      .def_property_readonly(
          "force_limit_n",
          [](const Scenario& scenario) { return scenario.controller.force_limit_n; },
          "A larger force ends the flight, N.")
      .def_property_readonly(
          "stages",
          [](const Scenario& scenario) {
            py::tuple stages(scenario.mission.size());
            for (std::size_t i = 0; i < scenario.mission.size(); ++i)
              stages[i] = to_stage(scenario.mission[i]);
            return stages;
          },
          "Of the mission: tuples (kind, name, for_s or None, lap_s or None).")
      .def("__repr__",
           [](const Scenario& scenario) {
             return py::str("<sls.Scenario {}: law {}, plant {}, {} s>")
                 .format(scenario.name, scenario.controller.law.name, scenario.plant.model.name,
                         config::to_seconds(scenario.sync.period_ns));
           })
      .def("__eq__", [](const Scenario& a,
                        const Scenario& b) { return a.sha256 == b.sha256 && a.folder == b.folder; })
      .def("__hash__", [](const Scenario& scenario) { return py::hash(py::str(scenario.sha256)); })
      .def(py::pickle(
          [](const Scenario& scenario) {
            return py::make_tuple(scenario.text, scenario.folder.string());
          },
          [](const py::tuple& state) {
            return make_scenario(std::nullopt, py::cast<std::string>(state[0]),
                                 py::cast<std::string>(state[1]), {});
          }));
}

}  // namespace sls::python
