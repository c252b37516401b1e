// An autopilot from a shared library of the user: sls_autopilot.h.
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

#include "common/plugin/shared_library.hpp"
#include "common/plugin/tables.hpp"
#include "sim_server/autopilots/autopilot.hpp"
#include "sim_server/autopilots/shared_library/sls_autopilot.h"

namespace sls::sim {
namespace {

using plugin::copy;
using plugin::ErrorText;
using plugin::to_vector;

std::vector<sls_autopilot_rotor> make_rotors(const std::vector<Rotor>& rotors) {
  std::vector<sls_autopilot_rotor> made;
  for (const Rotor& rotor : rotors) {
    sls_autopilot_rotor& given = made.emplace_back();
    given.size = sizeof given;
    copy(rotor.p_BR, given.position_m);
    copy(rotor.axis_B, given.axis);
    given.spin = rotor.spin;
    given.thrust_constant_n_s2 = rotor.thrust_constant;
    given.torque_constant_m = rotor.torque_constant;
    given.min_speed_rad_s = rotor.min_speed;
    given.max_speed_rad_s = rotor.max_speed;
  }
  return made;
}

class SharedLibraryAutopilot : public Autopilot {
 public:
  explicit SharedLibraryAutopilot(const AutopilotSetup& setup)
      : library_(setup.folder / setup.autopilot.model.name,
                 setup.autopilot.model.describe_place("autopilot.model")),
        vehicle_id_(setup.vehicle_id),
        period_(1e-9 * static_cast<double>(setup.autopilot.period_ns)),
        parameters_(setup.autopilot.own.get<config::LibraryParameters>()),
        rotors_(make_rotors(setup.airframe.rotors)),
        functions_(load_functions()) {
    const sls_autopilot_setup given = make_setup(setup);
    void* made = plugin::create_object(
        library_, call("create"), parameters_.describe_place(setup.autopilot.model, "autopilot"),
        [&](char* error, std::size_t size) { return functions_.create(&given, error, size); });
    autopilot_.reset(made, [this](void* autopilot) {
      plugin::call_at_end(call("destroy"), [&] { functions_.destroy(autopilot); });
    });
  }
  SharedLibraryAutopilot(const SharedLibraryAutopilot&) = delete;
  SharedLibraryAutopilot& operator=(const SharedLibraryAutopilot&) = delete;

  const AutopilotOutput& step(const AutopilotInput& input) override;

 private:
  sls_autopilot_functions load_functions() const;
  sls_autopilot_setup make_setup(const AutopilotSetup& setup) const;
  sls_autopilot_input make_input(const AutopilotInput& input) const;

  plugin::Call call(const char* function) const {
    return {library_.name().c_str(), function, vehicle_id_, steps_};
  }

  const plugin::SharedLibrary library_;
  const std::uint32_t vehicle_id_;
  const double period_;  // s
  const config::LibraryParameters parameters_;
  const std::vector<sls_autopilot_rotor> rotors_;
  std::uint64_t steps_ = 0;
  const sls_autopilot_functions functions_;
  std::shared_ptr<void> autopilot_;
  std::vector<double> speeds_;
  AutopilotOutput output_;
};

sls_autopilot_functions SharedLibraryAutopilot::load_functions() const {
  const auto& functions = plugin::load_table<sls_autopilot_functions>(
      library_, call("sls_autopilot"), SLS_AUTOPILOT_VERSION);
  plugin::check_size(library_, "sls_autopilot_setup", sizeof(sls_autopilot_setup),
                     functions.setup_size);
  plugin::check_size(library_, "sls_autopilot_rotor", sizeof(sls_autopilot_rotor),
                     functions.rotor_size);
  plugin::check_size(library_, "sls_autopilot_input", sizeof(sls_autopilot_input),
                     functions.input_size);
  plugin::check_size(library_, "sls_autopilot_output", sizeof(sls_autopilot_output),
                     functions.output_size);
  if (!functions.create || !functions.destroy || !functions.step)
    library_.fail("expected create, destroy and step, got a null pointer for one of them");
  return functions;
}

sls_autopilot_setup SharedLibraryAutopilot::make_setup(const AutopilotSetup& setup) const {
  sls_autopilot_setup given{};
  given.size = sizeof given;
  given.parameters = parameters_.json.c_str();
  given.vehicle_id = vehicle_id_;
  given.period_s = period_;
  given.quad_mass_kg = setup.vehicle.quad_mass;
  given.load_mass_kg = setup.vehicle.load_mass;
  given.rod_length_m = setup.vehicle.rod_length;
  given.gravity_m_s2 = setup.vehicle.gravity;
  given.body_mass_kg = setup.airframe.mass;
  copy(setup.airframe.p_BC, given.centre_of_mass_m);
  for (int row = 0; row < 3; ++row)
    copy(setup.airframe.inertia_C_B.row(row).transpose(), given.inertia_kg_m2[row]);
  given.rotor_count = static_cast<std::uint32_t>(rotors_.size());
  given.rotors = rotors_.data();
  return given;
}

sls_autopilot_input SharedLibraryAutopilot::make_input(const AutopilotInput& input) const {
  sls_autopilot_input given{};
  given.size = sizeof given;
  given.step = steps_;
  given.time_s = static_cast<double>(steps_) * period_;
  copy(input.f_Q_W, given.force_n);
  copy(input.v_WQ, given.velocity_m_s);
  copy(input.attitude.q_WB, given.attitude_wb);
  copy(input.attitude.w_WB_B, given.body_rates_rad_s);
  return given;
}

const AutopilotOutput& SharedLibraryAutopilot::step(const AutopilotInput& input) {
  // Guard values behind those of the rotors detect a library that writes too many speeds.
  constexpr std::size_t kBeyond = 8;
  constexpr double kUntouched = -7.25e300;
  speeds_.assign(rotors_.size(), std::numeric_limits<double>::quiet_NaN());
  speeds_.resize(rotors_.size() + kBeyond, kUntouched);
  sls_autopilot_output answer{};
  answer.size = sizeof answer;
  answer.rotor_speeds_rad_s = speeds_.data();
  answer.attitude_wb[0] = 1.0;
  const sls_autopilot_input given = make_input(input);
  ErrorText error;
  int code = 1;
  const plugin::Call stepping = call("step");
  call_guarded(stepping, [&] {
    code = functions_.step(autopilot_.get(), &given, &answer, error.data(), error.size());
  });

  const auto fail = [&](const std::string& defect) {
    throw std::runtime_error(stepping.describe() + ": " + defect);
  };
  const auto check_length = [&](double length, const char* kind, const char* name) {
    const std::string defect = plugin::find_length_defect(length, kind, name);
    if (!defect.empty()) fail(defect);
  };
  const auto check_finite = [&](const double* first, std::size_t count, const char* name) {
    for (std::size_t i = 0; i < count; ++i)
      if (!std::isfinite(first[i])) fail(name + ("[" + std::to_string(i) + "] is not finite"));
  };
  if (code != 0) fail(error.text());
  for (std::size_t i = rotors_.size(); i < speeds_.size(); ++i)
    if (speeds_[i] != kUntouched)
      fail("wrote the speed of rotor " + std::to_string(i) + ", expected at most the " +
           std::to_string(rotors_.size()) + " that there are");
  check_finite(speeds_.data(), rotors_.size(), "rotor_speeds_rad_s");
  for (std::size_t i = 0; i < rotors_.size(); ++i)
    if (speeds_[i] < 0.0)
      fail("rotor_speeds_rad_s[" + std::to_string(i) + "]: expected >= 0, got " +
           std::to_string(speeds_[i]));
  check_finite(answer.attitude_wb, 4, "attitude_wb");
  output_.q_WB = plugin::to_quaternion(answer.attitude_wb);
  check_length(output_.q_WB.norm(), "quaternion", "attitude_wb");
  if (!std::isfinite(answer.thrust_n)) fail("thrust_n is not finite");
  output_.direction_W.reset();
  if (answer.has_direction != 0) {
    check_finite(answer.direction, 3, "direction");
    output_.direction_W = to_vector(answer.direction);
    check_length(output_.direction_W->norm(), "vector", "direction");
  }
  output_.rotor_speeds =
      Eigen::Map<const Eigen::VectorXd>(speeds_.data(), static_cast<Eigen::Index>(rotors_.size()));
  output_.thrust = answer.thrust_n;
  ++steps_;
  return output_;
}

}  // namespace

std::unique_ptr<Autopilot> make_shared_library_autopilot(const AutopilotSetup& setup) {
  return std::make_unique<SharedLibraryAutopilot>(setup);
}

}  // namespace sls::sim
