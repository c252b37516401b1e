// A law from a shared library of the user: sls_controller.h.
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "common/plugin/shared_library.hpp"
#include "common/plugin/tables.hpp"
#include "control_client/laws/control_law.hpp"
#include "control_client/laws/shared_library/sls_controller.h"

namespace sls::control {
namespace {

using plugin::copy;
using plugin::ErrorText;

class SharedLibraryLaw : public ControlLaw {
 public:
  explicit SharedLibraryLaw(const LawSetup& setup)
      : library_(setup.folder / setup.controller.law.name,
                 setup.controller.law.describe_place("controller.law")),
        vehicle_id_(setup.vehicle_id),
        period_(setup.period),
        functions_(load_functions()) {
    const auto parameters = setup.controller.own.get<config::LibraryParameters>();
    const model::SlungLoadParameters& believed = setup.controller.model.vehicle;
    sls_controller_setup given{};
    given.size = sizeof given;
    given.parameters = parameters.json.c_str();
    given.vehicle_id = setup.vehicle_id;
    given.period_s = setup.period;
    given.quad_mass_kg = believed.quad_mass;
    given.load_mass_kg = believed.load_mass;
    given.rod_length_m = believed.rod_length;
    given.gravity_m_s2 = believed.gravity;
    given.force_limit_n = setup.controller.force_limit_n;
    void* made = plugin::create_object(
        library_, call("create", 0), parameters.describe_place(setup.controller.law, "controller"),
        [&](char* error, std::size_t size) {
          return functions_.create(&given, &memory_count_, error, size);
        });
    controller_.reset(made, [this](void* controller) {
      plugin::call_at_end(call("destroy", 0), [&] { functions_.destroy(controller); });
    });
    if (memory_count_ > SLS_CONTROLLER_MAX_MEMORY)
      library_.fail("create: expected at most " + std::to_string(SLS_CONTROLLER_MAX_MEMORY) +
                    " memory numbers, got " + std::to_string(memory_count_));
  }
  SharedLibraryLaw(const SharedLibraryLaw&) = delete;
  SharedLibraryLaw& operator=(const SharedLibraryLaw&) = delete;

  LawOutput calc(const LawInput& input) const override;
  int memory_size() const override { return static_cast<int>(memory_count_); }

 private:
  sls_controller_functions load_functions() const {
    const auto& functions = plugin::load_table<sls_controller_functions>(
        library_, call("sls_controller", 0), SLS_CONTROLLER_VERSION);
    plugin::check_size(library_, "sls_controller_setup", sizeof(sls_controller_setup),
                       functions.setup_size);
    plugin::check_size(library_, "sls_controller_input", sizeof(sls_controller_input),
                       functions.input_size);
    plugin::check_size(library_, "sls_controller_output", sizeof(sls_controller_output),
                       functions.output_size);
    if (!functions.create || !functions.destroy || !functions.answer)
      library_.fail("expected create, destroy and answer, got a null pointer for one of them");
    return functions;
  }

  plugin::Call call(const char* function, std::uint64_t step) const {
    return {library_.name().c_str(), function, vehicle_id_, step};
  }

  const plugin::SharedLibrary library_;
  const std::uint32_t vehicle_id_;
  const double period_;  // s
  const sls_controller_functions functions_;
  std::shared_ptr<void> controller_;
  std::uint32_t memory_count_ = 0;
};

sls_controller_input make_input(const LawInput& input, double period) {
  sls_controller_input given;
  given.size = sizeof given;
  given.step = input.step;
  given.time_s = static_cast<double>(input.step) * period;
  copy(input.state.p_WQ, given.quad_position_m);
  copy(input.state.v_WQ, given.quad_velocity_m_s);
  copy(input.state.attitude.q_WB, given.attitude_wb);
  copy(input.state.attitude.w_WB_B, given.body_rates_rad_s);
  copy(input.state.p_WL, given.load_position_m);
  copy(input.state.v_WL, given.load_velocity_m_s);
  given.alpha_rad = input.state.rod.alpha;
  given.beta_rad = input.state.rod.beta;
  given.alpha_dot_rad_s = input.state.rod.alpha_dot;
  given.beta_dot_rad_s = input.state.rod.beta_dot;
  given.signal_count = static_cast<std::uint32_t>(input.state.signals.size());
  given.signals = input.state.signals.data();
  given.stage = input.stage;
  given.stage_time_s = input.stage_time;
  copy(input.reference.position, given.reference_position_m);
  copy(input.reference.velocity, given.reference_velocity_m_s);
  copy(input.reference.acceleration, given.reference_acceleration_m_s2);
  copy(input.reference.jerk, given.reference_jerk_m_s3);
  copy(input.reference.snap, given.reference_snap_m_s4);
  given.memory = input.memory.data();
  return given;
}

ErrorCode to_error_code(int code) {
  switch (code) {
    case SLS_CONTROLLER_OK:
      return ErrorCode::kNone;
    case SLS_CONTROLLER_FREE_FALL:
      return ErrorCode::kFreeFall;
    case SLS_CONTROLLER_ROD_LEVEL:
      return ErrorCode::kRodLevel;
    default:
      return ErrorCode::kNotFinite;
  }
}

LawOutput SharedLibraryLaw::calc(const LawInput& input) const {
  // The numbers after the declared ones get a mark: a library that changes one has written beyond
  // its memory.
  constexpr double kUntouched = -7.25e300;
  std::array<double, SLS_CONTROLLER_MAX_MEMORY + 1> memory;
  std::fill_n(memory.begin(), memory_count_, 0.0);
  std::fill(memory.begin() + memory_count_, memory.end(), kUntouched);
  const sls_controller_input given = make_input(input, period_);
  sls_controller_output answer{sizeof answer, {}, memory.data()};
  ErrorText error;
  int code = SLS_CONTROLLER_ERROR;
  const plugin::Call answering = call("answer", input.step);
  call_guarded(answering, [&] {
    code = functions_.answer(controller_.get(), &given, &answer, error.data(), error.size());
  });
  const auto fail = [&](const std::string& defect) {
    throw std::runtime_error(answering.describe() + ": " + defect);
  };
  if (code == SLS_CONTROLLER_ERROR) fail(error.text());
  if (code < SLS_CONTROLLER_OK || code > SLS_CONTROLLER_ERROR)
    fail("expected a return value from 0 to 4, got " + std::to_string(code));
  for (std::size_t i = memory_count_; i < memory.size(); ++i)
    if (memory[i] != kUntouched)
      fail("wrote memory number " + std::to_string(i) + ", expected at most the " +
           std::to_string(memory_count_) + " that create asked for");
  LawOutput output;
  output.error_code = to_error_code(code);
  if (output.error_code != ErrorCode::kNone) return output;
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(answer.force_n[i])) fail("force_n[" + std::to_string(i) + "] is not finite");
  for (std::size_t i = 0; i < memory_count_; ++i)
    if (!std::isfinite(memory[i])) fail("memory[" + std::to_string(i) + "] is not finite");
  output.f_Q_W = Eigen::Map<const Eigen::Vector3d>(answer.force_n);
  output.memory =
      Eigen::Map<const Eigen::VectorXd>(memory.data(), static_cast<Eigen::Index>(memory_count_));
  return output;
}

}  // namespace

std::unique_ptr<const ControlLaw> make_shared_library_law(const LawSetup& setup) {
  return std::make_unique<SharedLibraryLaw>(setup);
}

}  // namespace sls::control
