// `_sls_core.Runs`: sls.campaign flies the runs of a campaign with it.
#include <pybind11/stl.h>

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "closed_loop/campaign_runs.hpp"
#include "python/bindings/bindings.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;

/// Checks for Ctrl-C ten times a second while C++ code runs without the GIL.
class SignalCheck {
 public:
  void operator()() {
    const auto now = Clock::now();
    if (now - last_ < kInterval) return;
    last_ = now;
    const py::gil_scoped_acquire lock;
    check_signals();
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kInterval{100};
  Clock::time_point last_ = Clock::now();
};

/// Flies the runs of a campaign. One object for each process.
class Runs {
 public:
  using Row = std::tuple<std::string, std::string, std::vector<double>, std::string, std::uint64_t>;

  Runs(const std::string& base_file, std::vector<std::string> paths,
       std::vector<std::string> measures, std::optional<double> period_s)
      : runs_(base_file, std::move(paths), std::move(measures), period_s, SignalCheck()) {}

  const std::vector<std::string>& columns() const { return runs_.columns(); }

  std::string scenario_text(const std::vector<std::string>& values) const {
    return runs_.make_scenario(values).text;
  }

  Row fly(const std::vector<std::string>& values, bool certify) {
    closed_loop::MeasuredFlight flown = runs_.fly(values, certify, std::ref(signals_));
    return {to_string(flown.outcome), std::move(flown.reason), std::move(flown.values),
            std::move(flown.certificate), flown.steps};
  }

  void check(const std::vector<std::string>& values) const { runs_.check(values); }

 private:
  closed_loop::CampaignRuns runs_;
  SignalCheck signals_;  // one for all runs, because most runs are shorter than its interval
};

}  // namespace

void add_campaign(py::module_& module) {
  using WithoutLock = py::call_guard<py::gil_scoped_release>;
  py::class_<Runs>(module, "Runs",
                   "Flies the runs of a campaign, one after the other. Releases the interpreter's "
                   "lock while it flies.")
      .def(py::init<const std::string&, std::vector<std::string>, std::vector<std::string>,
                    std::optional<double>>(),
           py::arg("base_file"), py::arg("paths"), py::arg("measures"),
           py::arg("period_s") = py::none(), WithoutLock(),
           "Reads the scenario `base_file` and flies it once: runs are judged by that flight. "
           "`paths` are the keys that vary. ConfigError: the file, a measure or the period cannot "
           "be used, or that flight fails.")
      .def_property_readonly("columns", &Runs::columns, "Names of the measures' values.")
      .def("scenario_text", &Runs::scenario_text, py::arg("values"), WithoutLock(),
           "The run's scenario as YAML, with these YAML values, one for each path.")
      .def("fly", &Runs::fly, py::arg("values"), py::arg("certify"), WithoutLock(),
           "Flies a run: outcome (finished, lost, failed), reason, the values of the columns (NaN: "
           "not defined), certificate (empty unless `certify`), and the steps flown.")
      .def("check", &Runs::check, py::arg("values"), WithoutLock(),
           "ConfigError where the run cannot be flown. Flies nothing.");
}

}  // namespace sls::python
