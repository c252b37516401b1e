#include "tests/common/bus/sample_messages.hpp"

#include <limits>
#include <string>

#include "common/bus/sync_counters.hpp"

namespace sls::bus::test {
namespace {

/// Values that never repeat within a message.
class Values {
 public:
  explicit Values(std::uint64_t seed) : next_(seed * 100000 + 1) {}

  std::uint64_t count() { return (next_++) << 20 | 0xabcde; }  // beyond 32 bits for seeds > 0
  std::uint32_t small() { return static_cast<std::uint32_t>(next_++); }
  std::int64_t number() { return -static_cast<std::int64_t>(count()); }
  double real() { return 1.0 / (3.0 + static_cast<double>(next_++)); }
  std::array<double, 3> vector() { return {real(), -real(), real() * 1e300}; }
  /// With bytes beyond ASCII, which a string may hold.
  std::string text(std::size_t length) {
    std::string text = std::to_string(next_++) + " ä\n\"";
    while (text.size() < length) text += static_cast<char>('a' + (text.size() + next_) % 26);
    return text.substr(0, length);
  }

 private:
  std::uint64_t next_;
};

ControllerState make_controller_state(Values& values) {
  ControllerState state;
  state.stage_index(values.small());
  state.stage_start_step(values.count());
  state.integral_m_s(values.vector());
  return state;
}

}  // namespace

template <>
VehicleState make_message(std::uint64_t seed) {
  Values values(seed);
  VehicleState message;
  message.run_id(values.count());
  message.vehicle_id(values.small());
  message.step(std::numeric_limits<std::uint64_t>::max() - seed);
  message.sim_time_ns(values.number());
  message.p_WQ_m(values.vector());
  message.v_WQ_m_s(values.vector());
  message.p_WL_m(values.vector());
  message.v_WL_m_s(values.vector());
  message.alpha_rad(values.real());
  message.beta_rad(values.real());
  message.alpha_dot_rad_s(-0.0);
  message.beta_dot_rad_s(std::numeric_limits<double>::denorm_min());
  message.f_Q_W_n(values.vector());
  message.controller_name(values.text(32));
  message.controller(make_controller_state(values));
  return message;
}

template <>
ControlCommand make_message(std::uint64_t seed) {
  Values values(seed);
  ControlCommand message;
  message.run_id(values.count());
  message.vehicle_id(values.small());
  message.step(values.count());
  message.f_Q_W_n(values.vector());
  message.client_name(values.text(32));
  message.strength(std::numeric_limits<std::int32_t>::min());
  message.controller(make_controller_state(values));
  message.mission(MISSION_FAILED);
  message.fault(FAULT_STAGE_TIMEOUT);
  message.compute_time_ns(values.count());
  return message;
}

template <>
Reference make_message(std::uint64_t seed) {
  Values values(seed);
  Reference message;
  message.run_id(values.count());
  message.vehicle_id(values.small());
  message.step(values.count());
  message.sim_time_ns(values.number());
  message.client_name(values.text(32));
  message.stage_index(values.small());
  message.stage_name(values.text(32));
  message.position_m(values.vector());
  message.velocity_m_s(values.vector());
  message.acceleration_m_s2(values.vector());
  message.jerk_m_s3(values.vector());
  message.snap_m_s4(values.vector());
  return message;
}

namespace {

/// As many vehicles as a sample holds.
template <class Fleet, class Vehicle>
Fleet make_fleet_message(std::uint64_t seed) {
  Values values(seed);
  Fleet message;
  message.run_id(values.count());
  message.step(values.count());
  for (std::uint64_t i = 0; i < FLEET_SAMPLE_VEHICLES; ++i)
    message.vehicles().push_back(make_message<Vehicle>(seed + i));
  return message;
}

}  // namespace

template <>
FleetState make_message(std::uint64_t seed) {
  return make_fleet_message<FleetState, VehicleState>(seed);
}
template <>
FleetCommand make_message(std::uint64_t seed) {
  return make_fleet_message<FleetCommand, ControlCommand>(seed);
}
template <>
FleetReference make_message(std::uint64_t seed) {
  return make_fleet_message<FleetReference, Reference>(seed);
}

template <>
Participant make_message(std::uint64_t seed) {
  Values values(seed);
  Participant message;
  message.run_id(values.count());
  message.vehicle_id(values.small());
  for (int i = 0; i < 256; ++i) message.vehicle_ids().push_back(values.small());
  message.role(ROLE_RECORDER);
  message.name(values.text(32));
  message.host(values.text(64));
  message.strength(std::numeric_limits<std::int32_t>::max());
  message.scenario_sha256(values.text(64));
  message.ready(true);
  message.done(seed % 2 == 1);
  message.last_complete_step(std::numeric_limits<std::int64_t>::min());
  return message;
}

template <>
Parameters make_message(std::uint64_t seed) {
  Values values(seed);
  Parameters message;
  message.run_id(values.count());
  message.vehicle_id(values.small());
  for (int i = 0; i < 256; ++i) message.vehicle_ids().push_back(values.small());
  message.scenario_sha256(values.text(64));
  message.scenario_text(values.text(32768));
  message.quad_mass_kg(values.real());
  message.load_mass_kg(values.real());
  message.rod_length_m(values.real());
  message.gravity_m_s2(values.real());
  message.period_ns(values.number());
  message.step_ns(values.number());
  message.mode(MODE_REALTIME);
  message.real_time_factor(values.real());
  message.version(values.text(32));
  return message;
}

template <>
SimStatus make_message(std::uint64_t seed) {
  Values values(seed);
  SimStatus message;
  message.run_id(values.count());
  message.vehicle_id(values.small());
  message.sample_index(values.count());
  message.phase(PHASE_FAILED);
  message.reason(values.text(255));
  message.step(values.count());
  message.controller_name(values.text(32));
  for (int i = 0; i < 256; ++i) message.controller_names().emplace_back().name(values.text(32));
  message.real_time_factor(values.real());
  for (const SyncCounter& counter : kSyncCounters)
    (message.counters().*counter.change)() = values.count();
  return message;
}

}  // namespace sls::bus::test
