#include "control_client/client.hpp"

#include <pybind11/pybind11.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/app/log.hpp"
#include "common/app/run_error.hpp"
#include "common/bus/qos_file.hpp"
#include "common/config/model_keys.hpp"
#include "common/config/vehicle_ids.hpp"
#include "python/bindings/bindings.hpp"
#include "python/bindings/python_law.hpp"

namespace sls::python {
namespace {

namespace py = pybind11;
using namespace std::chrono_literals;

constexpr const char* kIdentity = "controller";  // its keys are used on a secured domain
constexpr auto kSignalInterval = 50ms;           // between runs of Python's signal handlers

/// Ends a process that is still blocked after a stop signal, for example in a law that does not
/// return. The programs do the same.
[[noreturn]] void end_process(py::error_already_set& interruption) {
  std::fputs(
      "sls.Client: error: did not end after the stop signal: exits now, its files may be "
      "incomplete\n",
      stderr);
  ::_exit(interruption.matches(PyExc_KeyboardInterrupt) ? 128 + SIGINT : 128 + SIGTERM);
}

/// Parses `vehicles` like the option `--vehicles` of control_client. The text of the errors begins
/// with the name of this option.
std::vector<std::uint32_t> parse_vehicles(const std::string& text, std::size_t fleet_size) {
  try {
    return config::parse_vehicle_ids(text, fleet_size);
  } catch (const config::ConfigError& error) {
    throw config::ConfigError(std::string(error.what()).substr(2));  // without "--"
  }
}

/// A client whose law is a Python object. It installs no signal handlers and uses those of Python.
class PythonClient {
 public:
  PythonClient(const py::object& law, const config::Scenario& scenario, const std::string& name,
               std::int32_t strength, const std::string& vehicles, bool follow,
               const std::string& qos_file, int domain, std::string log_level, double patience_s)
      : scenario_(scenario),
        vehicle_ids_(parse_vehicles(vehicles, scenario_.vehicles.size())),
        qos_file_(qos_file.empty() ? bus::default_qos_file() : std::filesystem::path(qos_file)),
        domain_(domain),
        log_level_(std::move(log_level)),
        patience_(
            std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience_s))),
        law_(law) {
    const std::string defect = control::describe_name_defect(name);
    if (!defect.empty()) throw config::ConfigError("name: " + defect);
    options_.name = name;
    options_.strength = strength;
    options_.follows_servers = follow;
    options_.is_stopped = [this] { return is_stopped_.load(); };
    prepare_law();
    // Makes a law and discards it: an invalid law is refused before a server waits for this client.
    control::FlightController(config::make_vehicle_scenario(scenario_, vehicle_ids_.front()),
                              vehicle_ids_.front(), false, options_.make_law);
  }

  void stop() { is_stopped_ = true; }

  /// Flies in a second thread, because the calling thread runs Python's signal handlers.
  void run() {
    if (is_running_.exchange(true))
      throw config::ConfigError("Client.run: expected one call at a time, another is at work");
    prepare_law();
    is_done_ = false;
    std::thread flight([this] { fly(); });
    std::optional<py::error_already_set> interruption;
    Clock::time_point give_up;
    while (!wait()) {
      if (interruption) {
        if (Clock::now() > give_up) end_process(*interruption);
      } else if (PyErr_CheckSignals() != 0) {
        interruption.emplace();
        give_up = Clock::now() + patience_;
        is_stopped_ = true;
      }
    }
    {
      const py::gil_scoped_release release;
      flight.join();
    }
    is_stopped_ = false;
    is_running_ = false;
    const std::exception_ptr failure = std::exchange(failure_, nullptr);
    if (interruption) throw py::error_already_set(std::move(*interruption));
    errors_->raise_first();
    if (failure) std::rethrow_exception(failure);
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// Prepares new laws and a new list of their errors for the next run.
  void prepare_law() {
    const bool has_attitude =
        config::find_model_keys(config::all_models().plants, scenario_.plant.model)
            .has_attitude(scenario_.plant);
    errors_ = std::make_shared<LawErrors>();
    options_.make_law = make_python_law_maker(law_, has_attitude, errors_);
  }

  void fly() {
    std::exception_ptr failure;
    try {
      app::start_log("sls.Client", log_level_);
      bus::Node node(qos_file_, domain_, bus::kClientNode, kIdentity);
      control::Client(node, scenario_, vehicle_ids_, options_).run();
    } catch (const bus::BusError& error) {
      failure = std::make_exception_ptr(app::RunError(error.what()));
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    failure_ = failure;
    is_done_ = true;
    done_.notify_all();
  }

  /// Waits for the end of the flight for kSignalInterval at most. True if the flight has ended.
  bool wait() {
    const py::gil_scoped_release release;
    std::unique_lock lock(mutex_);
    return done_.wait_for(lock, kSignalInterval, [this] { return is_done_; });
  }

  const config::Scenario scenario_;
  const std::vector<std::uint32_t> vehicle_ids_;
  const std::filesystem::path qos_file_;
  const int domain_;
  const std::string log_level_;
  const Clock::duration patience_;  // after a stop signal
  const py::object law_;
  std::shared_ptr<LawErrors> errors_;
  control::ClientOptions options_;
  std::atomic<bool> is_stopped_{false};
  std::atomic<bool> is_running_{false};

  std::mutex mutex_;  // protects the members below
  std::condition_variable done_;
  bool is_done_ = false;
  std::exception_ptr failure_;
};

}  // namespace

void add_client(py::module_& module) {
  py::class_<PythonClient>(module, "Client", "A Python law over DDS: sls.Client is its face.")
      .def(py::init<const py::object&, const config::Scenario&, const std::string&, std::int32_t,
                    const std::string&, bool, const std::string&, int, std::string, double>(),
           py::arg("law"), py::arg("scenario"), py::arg("name"), py::arg("strength"),
           py::arg("vehicles"), py::arg("follow"), py::arg("qos"), py::arg("domain"),
           py::arg("log_level"), py::arg("patience_s"))
      .def("run", &PythonClient::run)
      .def("stop", &PythonClient::stop);
}

}  // namespace sls::python
