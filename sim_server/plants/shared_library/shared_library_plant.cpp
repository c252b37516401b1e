// A plant from a shared library of the user: sls_plant.h.
#include <cmath>
#include <memory>
#include <stdexcept>

#include "common/plugin/shared_library.hpp"
#include "common/plugin/tables.hpp"
#include "sim_server/plants/plant.hpp"
#include "sim_server/plants/shared_library/sls_plant.h"

namespace sls::sim {
namespace {

using plugin::copy;
using plugin::ErrorText;
using plugin::to_vector;

constexpr const char* kNameLetters = "abcdefghijklmnopqrstuvwxyz0123456789_";

sls_plant_state make_initial(const config::InitialState& initial, double rod_length) {
  const Eigen::Vector3d n_W = model::to_direction(initial.rod).n_W;
  const bool is_load_placed = initial.placed == config::Body::kLoad;
  const Eigen::Vector3d p_WQ = initial.position - (is_load_placed ? rod_length : 0.0) * n_W;
  const model::SlungLoadState bodies =
      model::make_state(p_WQ, initial.v_WQ, initial.rod, rod_length);
  sls_plant_state state{};
  state.size = sizeof state;
  copy(bodies.p_WQ, state.quad_position_m);
  copy(bodies.v_WQ, state.quad_velocity_m_s);
  copy(bodies.p_WL, state.load_position_m);
  copy(bodies.v_WL, state.load_velocity_m_s);
  state.attitude_wb[0] = 1.0;
  return state;
}

class SharedLibraryPlant : public Plant {
 public:
  explicit SharedLibraryPlant(const PlantSetup& setup)
      : library_(setup.folder / setup.plant.model.name,
                 setup.plant.model.describe_place("plant.model")),
        vehicle_id_(setup.vehicles[0].id),
        functions_(load_functions()) {
    const auto parameters = setup.plant.own.get<config::LibraryParameters>();
    const model::SlungLoadParameters& vehicle = setup.vehicles[0].parameters;
    sls_plant_setup given{};
    given.size = sizeof given;
    given.parameters = parameters.json.c_str();
    given.vehicle_id = vehicle_id_;
    given.step_s = 1e-9 * static_cast<double>(setup.plant.step_ns);
    given.quad_mass_kg = vehicle.quad_mass;
    given.load_mass_kg = vehicle.load_mass;
    given.rod_length_m = vehicle.rod_length;
    given.gravity_m_s2 = vehicle.gravity;
    given.initial = make_initial(setup.vehicles[0].initial, vehicle.rod_length);
    void* made = plugin::create_object(
        library_, call("create"), parameters.describe_place(setup.plant.model, "plant"),
        [&](char* error, std::size_t size) { return functions_.create(&given, error, size); });
    plant_.reset(made, [this](void* plant) {
      plugin::call_at_end(call("destroy"), [&] { functions_.destroy(plant); });
    });
    measurement_ = measure();
  }
  SharedLibraryPlant(const SharedLibraryPlant&) = delete;
  SharedLibraryPlant& operator=(const SharedLibraryPlant&) = delete;

  void advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) override {
    check_finite(f_Q_W[0], steps_, "force_x_n", "force_y_n", "force_z_n");
    ErrorText error;
    int code = 1;
    const plugin::Call advancing = call("advance");
    call_guarded(advancing, [&] {
      code = functions_.advance(plant_.get(), f_Q_W[0].data(), steps, error.data(), error.size());
    });
    if (code != 0) throw std::runtime_error(advancing.describe() + ": " + error.text());
    steps_ += steps;
    measurement_ = measure();
  }

  const model::Measurement& measurement(std::size_t) const override { return measurement_; }

  bool has_attitude() const override { return true; }

  std::vector<Signal> signals() const override {
    std::vector<Signal> signals;
    for (std::uint32_t i = 0; i < functions_.signal_count; ++i)
      signals.push_back({functions_.signal_names[i], functions_.signal_units[i]});
    return signals;
  }

 private:
  sls_plant_functions load_functions() const {
    const auto& functions =
        plugin::load_table<sls_plant_functions>(library_, call("sls_plant"), SLS_PLANT_VERSION);
    plugin::check_size(library_, "sls_plant_setup", sizeof(sls_plant_setup), functions.setup_size);
    plugin::check_size(library_, "sls_plant_state", sizeof(sls_plant_state), functions.state_size);
    if (!functions.create || !functions.destroy || !functions.advance || !functions.measure)
      library_.fail("expected create, destroy, advance and measure, got a null pointer for one");
    if (functions.signal_count > SLS_PLANT_MAX_SIGNALS)
      library_.fail("expected at most " + std::to_string(SLS_PLANT_MAX_SIGNALS) + " signals, got " +
                    std::to_string(functions.signal_count));
    for (std::uint32_t i = 0; i < functions.signal_count; ++i) {
      if (!functions.signal_names[i] || !functions.signal_units[i])
        library_.fail("expected a name and a unit for signal " + std::to_string(i) + ", got none");
      const std::string name = functions.signal_names[i];
      if (name.empty() || name.find_first_not_of(kNameLetters) != name.npos)
        library_.fail("expected lower-case letters, digits and '_' as the name of signal " +
                      std::to_string(i) + ", got '" + name + "'");
    }
    return functions;
  }

  plugin::Call call(const char* function) const {
    return {library_.name().c_str(), function, vehicle_id_, static_cast<std::uint64_t>(steps_)};
  }

  model::Measurement measure() const {
    sls_plant_state state{};
    state.size = sizeof state;
    const plugin::Call measuring = call("measure");
    call_guarded(measuring, [&] { functions_.measure(plant_.get(), &state); });
    model::Measurement measured =
        model::make_state(to_vector(state.quad_position_m), to_vector(state.quad_velocity_m_s),
                          to_vector(state.load_position_m), to_vector(state.load_velocity_m_s));
    measured.attitude.q_WB = plugin::to_quaternion(state.attitude_wb);
    measured.attitude.w_WB_B = to_vector(state.body_rates_rad_s);
    measured.signals = Eigen::Map<const Eigen::VectorXd>(state.signals, functions_.signal_count);
    const auto fail = [&](const std::string& defect) {
      throw std::runtime_error(measuring.describe() + ": " + defect);
    };
    try {
      check_finite(measured, steps_);
    } catch (const std::runtime_error& error) {
      fail(error.what());
    }
    const std::string defect =
        plugin::find_length_defect(measured.attitude.q_WB.norm(), "quaternion", "attitude_wb");
    if (!defect.empty()) fail(defect);
    if (!measured.attitude.w_WB_B.allFinite()) fail("body_rates_rad_s is not finite");
    for (std::uint32_t i = 0; i < functions_.signal_count; ++i)
      if (!std::isfinite(measured.signals[i]))
        fail(std::string("signal ") + functions_.signal_names[i] + " is not finite");
    return measured;
  }

  const plugin::SharedLibrary library_;
  const std::uint32_t vehicle_id_;
  std::int64_t steps_ = 0;
  const sls_plant_functions functions_;
  std::shared_ptr<void> plant_;
  model::Measurement measurement_;
};

}  // namespace

PlantType shared_library_plant_type() {
  return {Moves::kOneVehicle, [](const PlantSetup& setup) -> std::unique_ptr<Plant> {
            return std::make_unique<SharedLibraryPlant>(setup);
          }};
}

}  // namespace sls::sim
