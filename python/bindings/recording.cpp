#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>

#include "control_client/laws/qsf/lqr.hpp"
#include "python/bindings/bindings.hpp"
#include "recorder/recording_reader.hpp"
#include "recorder/verification.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;

/// (steps, certificate, problems)
py::tuple inspect(const std::string& folder) {
  record::Inspection inspection;
  {
    const py::gil_scoped_release released;
    inspection = record::inspect(record::open_recording(folder));
  }
  return py::make_tuple(inspection.steps, inspection.certificate, inspection.problems);
}

/// (first difference or None, notes)
py::tuple compare(const std::string& folder_a, const std::string& folder_b) {
  std::optional<record::Difference> difference;
  std::vector<std::string> notes;
  {
    const py::gil_scoped_release released;
    const record::OpenedRecording a = record::open_recording(folder_a);
    const record::OpenedRecording b = record::open_recording(folder_b);
    difference = record::find_first_difference(a, b);
    notes = record::list_notes(a, b);
  }
  return py::make_tuple(difference ? py::object(py::str(difference->text)) : py::none(), notes);
}

py::dict to_dict(const control::AxisGains& gains, bool has_rod) {
  py::dict dict;
  dict["position"] = gains.position;
  dict["velocity"] = gains.velocity;
  if (has_rod) {
    dict["acceleration"] = gains.acceleration;
    dict["jerk"] = gains.jerk;
  }
  return dict;
}

py::dict calc_lqr(double horizontal, double vertical) {
  const control::NamedGains gains =
      control::make_named_gains(control::LqrWeights{horizontal, vertical});
  py::dict dict;
  dict["horizontal"] = to_dict(gains.horizontal, true);
  dict["vertical"] = to_dict(gains.vertical, false);
  return dict;
}

}  // namespace

void add_recording(py::module_& module) {
  module.def("inspect_recording", &inspect, py::arg("folder"));
  module.def("compare_recordings", &compare, py::arg("a"), py::arg("b"));
  module.def("lqr", &calc_lqr, py::arg("horizontal"), py::arg("vertical"));
}

}  // namespace sls::python
