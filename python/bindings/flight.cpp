#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/app/run_error.hpp"
#include "common/config/scenario.hpp"
#include "python/bindings/bindings.hpp"
#include "python/bindings/flight_table.hpp"
#include "python/bindings/python_law.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;
using Ids = std::vector<std::uint32_t>;

Ids list_ids(const config::Scenario& scenario, std::optional<std::uint32_t> vehicle) {
  const std::size_t count = scenario.vehicles.size();
  if (!vehicle) return closed_loop::list_vehicles(scenario);
  if (*vehicle >= count)
    throw config::ConfigError("vehicle: expected one of " + scenario.name + ", 0 to " +
                              std::to_string(count - 1) + ", got " + std::to_string(*vehicle));
  return {*vehicle};
}

/// The Python laws of the vehicles that `controllers` names; the scenario's law of the others.
control::LawMaker make_mixed_law_maker(const std::map<std::uint32_t, py::object>& controllers,
                                       bool has_attitude,
                                       const std::shared_ptr<LawErrors>& errors) {
  std::map<std::uint32_t, control::LawMaker> own;
  for (const auto& [id, controller] : controllers)
    own[id] = make_python_law_maker(controller, has_attitude, errors);
  return [own](const control::LawSetup& setup) {
    const auto found = own.find(setup.vehicle_id);
    return found == own.end() ? control::make_control_law(setup) : found->second(setup);
  };
}

std::unique_ptr<FlightTable> fly(config::Scenario scenario, const py::object& controller,
                                 std::optional<std::uint32_t> vehicle, bool check_purity) {
  scenario.sync.mode = config::SyncMode::kLockstep;  // no answer can be late in one process
  const Ids ids = list_ids(scenario, vehicle);
  closed_loop::FlightOptions options;
  options.checks_purity = check_purity;
  if (controller.is_none()) {
    const py::gil_scoped_release released;
    return std::make_unique<FlightTable>(scenario, ids, options, [] {
      const py::gil_scoped_acquire gil;
      check_signals();
    });
  }

  const auto plants = sim::make_plants(sim::find_plant_type(scenario.plant.model), scenario, ids);
  const auto errors = std::make_shared<LawErrors>();
  options.controller_name = "python";
  const bool has_attitude = plants.front().plant->has_attitude();
  if (py::isinstance<py::dict>(controller)) {
    options.make_law = make_mixed_law_maker(controller.cast<std::map<std::uint32_t, py::object>>(),
                                            has_attitude, errors);
  } else {
    options.make_law = make_python_law_maker(controller, has_attitude, errors);
    scenario.controller.law.name = name_controller(controller);  // for messages
  }
  // The flight holds the GIL, because the law needs it at every step. Other threads get it while
  // the law runs, as during any Python code, and at each call of the lambda below.
  try {
    return std::make_unique<FlightTable>(scenario, ids, options, [] {
      check_signals();
      const py::gil_scoped_release released;
    });
  } catch (const app::RunError&) {
    errors->raise_first();
    throw;  // the check of purity has refused the law
  }
}

/// The rows of a vehicle, (steps, columns), without a copy. The array keeps their memory alive.
py::array make_rows(const py::object& self, std::size_t index) {
  const RowBuffer& rows = py::cast<const FlightTable&>(self).rows(index);
  const auto to_size = [](std::size_t size) { return static_cast<py::ssize_t>(size); };
  const py::array array(py::dtype::of<double>(), {to_size(rows.rows()), to_size(rows.width())},
                        rows.row(0), self);
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

py::list list_columns(const FlightTable& flight) {
  const char* const kinds[] = {"double", "integer", "fault", "stage_name"};
  py::list columns;
  for (const ColumnPlace& place : flight.columns())
    columns.append(py::make_tuple(place.table, place.name, place.index,
                                  kinds[static_cast<std::size_t>(place.kind)]));
  return columns;
}

}  // namespace

void add_flight(py::module_& module) {
  py::class_<FlightTable>(module, "FlightTable", "A flight that is kept; sls.Flight shows it.")
      .def_property_readonly("vehicle_ids", &FlightTable::ids)
      .def_property_readonly("failure", &FlightTable::failure)
      .def_property_readonly("last_step", &FlightTable::last_step)
      .def_property_readonly("columns", &list_columns,
                             "Tuples (table, name, index in a row, kind of the cell).")
      // A property itself takes no guard: pybind11 2 left it out without a word, 3 refuses it.
      .def_property_readonly("certificate",
                             py::cpp_function(&FlightTable::calc_certificate,
                                              py::call_guard<py::gil_scoped_release>()))
      .def("can_measurement_differ", &FlightTable::can_measurement_differ, py::arg("index"))
      .def("rows", &make_rows, py::arg("index"),
           "Cells of the index-th vehicle, (steps, columns), read-only and not copied.")
      .def(
          "save",
          [](const FlightTable& flight, const std::string& folder, bool force) {
            return flight.save(folder, force);
          },
          py::arg("folder"), py::arg("force"), py::call_guard<py::gil_scoped_release>());
  const char* const codes[] = {
      to_string(model::ErrorCode::kNone), to_string(model::ErrorCode::kFreeFall),
      to_string(model::ErrorCode::kRodLevel), to_string(model::ErrorCode::kNotFinite),
      to_string(model::ErrorCode::kStageTimeout)};
  module.attr("FAULTS") = py::make_tuple(codes[0], codes[1], codes[2], codes[3], codes[4]);
  module.def("fly", &fly, py::arg("scenario"), py::arg("controller") = py::none(),
             py::arg("vehicle") = py::none(), py::arg("check_purity") = false);
}

}  // namespace sls::python
