#include "tests/common/bus/sample_messages.hpp"

#include <limits>
#include <string>
#include <vector>

#include "common/bus/sync_counters.hpp"

namespace sls::test {
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
  std::vector<double> numbers() {
    std::vector<double> numbers(MOST_NUMBERS);
    for (double& number : numbers) number = real();
    return numbers;
  }
  /// Text with bytes beyond ASCII, which a string may contain.
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
  state.numbers(values.numbers());
  return state;
}

PlantState make_plant_state(Values& values) {
  PlantState state;
  state.p_WQ_m(values.vector());
  state.v_WQ_m_s(values.vector());
  state.q_WB({values.real(), values.real(), -values.real(), values.real()});
  state.w_WB_B_rad_s(values.vector());
  state.p_WL_m(values.vector());
  state.v_WL_m_s(values.vector());
  state.alpha_rad(values.real());
  state.beta_rad(values.real());
  state.alpha_dot_rad_s(-0.0);
  state.beta_dot_rad_s(std::numeric_limits<double>::denorm_min());
  state.signals(values.numbers());
  return state;
}

Reference make_reference(Values& values) {
  Reference reference;
  reference.stage_index(values.small());
  reference.stage_name(values.text(32));
  reference.position_m(values.vector());
  reference.velocity_m_s(values.vector());
  reference.acceleration_m_s2(values.vector());
  reference.jerk_m_s3(values.vector());
  reference.snap_m_s4(values.vector());
  return reference;
}

VehicleState make_vehicle_state(Values& values) {
  VehicleState state;
  state.vehicle_id(values.small());
  state.measured(make_plant_state(values));
  state.f_Q_W_n(values.vector());
  state.force_origin(ForceOrigin::FORCE_FAIL_SAFE);
  state.controller_name(values.text(32));
  state.controller(make_controller_state(values));
  return state;
}

ControlCommand make_command(Values& values) {
  ControlCommand command;
  command.vehicle_id(values.small());
  command.f_Q_W_n(values.vector());
  command.reference(make_reference(values));
  command.controller(make_controller_state(values));
  command.mission(MissionPhase::MISSION_FAILED);
  command.fault(FaultCode::FAULT_STAGE_TIMEOUT);
  command.compute_time_ns(values.count());
  return command;
}

}  // namespace

template <>
States make_message(std::uint64_t seed) {
  Values values(seed);
  States message;
  message.run_id(values.count());
  message.step(std::numeric_limits<std::uint64_t>::max() - seed);
  message.sim_time_ns(values.number());
  while (message.vehicles().size() < SAMPLE_VEHICLES)
    message.vehicles().push_back(make_vehicle_state(values));
  return message;
}

template <>
Commands make_message(std::uint64_t seed) {
  Values values(seed);
  Commands message;
  message.run_id(values.count());
  message.step(values.count());
  message.client_name(values.text(32));
  message.strength(std::numeric_limits<std::int32_t>::min());
  while (message.vehicles().size() < SAMPLE_VEHICLES)
    message.vehicles().push_back(make_command(values));
  return message;
}

template <>
RecordBatch make_message(std::uint64_t seed) {
  Values values(seed);
  RecordBatch message;
  message.run_id(values.count());
  message.batch_index(values.count());
  message.is_last(seed % 2 == 1);
  while (message.entries().size() < BATCH_ENTRIES) {
    RecordEntry& entry = message.entries().emplace_back();
    entry.vehicle_id(values.small());
    entry.step(values.count());
    entry.kind(AnswerKind::ANSWER_LATE);
    entry.truth(make_plant_state(values));
    entry.measured().push_back(make_plant_state(values));
    entry.f_Q_W_n(values.vector());
    entry.answered_step(values.count());
    entry.client_name(values.text(32));
    entry.answer(make_command(values));
  }
  return message;
}

template <>
Participant make_message(std::uint64_t seed) {
  Values values(seed);
  Participant message;
  message.run_id(values.count());
  message.contract_sha256(values.text(64));
  for (int i = 0; i < 256; ++i) message.vehicle_ids().push_back(values.small());
  message.role(ParticipantRole::ROLE_RECORDER);
  message.name(values.text(32));
  message.host(values.text(64));
  message.strength(std::numeric_limits<std::int32_t>::max());
  message.scenario_sha256(values.text(64));
  message.library_sha256(values.text(64));
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
  message.contract_sha256(values.text(64));
  message.version(values.text(32));
  message.scenario_sha256(values.text(64));
  message.scenario_text(values.text(32768));
  message.library_sha256(values.text(64));
  for (int i = 0; i < 256; ++i) {
    VehicleParameters& vehicle = message.vehicles().emplace_back();
    vehicle.vehicle_id(values.small());
    vehicle.quad_mass_kg(values.real());
    vehicle.load_mass_kg(values.real());
    vehicle.rod_length_m(values.real());
    vehicle.gravity_m_s2(values.real());
  }
  message.has_attitude(true);
  while (message.signals().size() < MOST_NUMBERS) {
    SignalDescription& signal = message.signals().emplace_back();
    signal.name(values.text(32));
    signal.unit(values.text(16));
  }
  message.force_limit_n(values.real());
  message.expected_recorders(values.small());
  message.period_ns(values.number());
  message.step_ns(values.number());
  message.mode(SyncMode::MODE_REALTIME);
  message.real_time_factor(values.real());
  return message;
}

template <>
SimStatus make_message(std::uint64_t seed) {
  Values values(seed);
  SimStatus message;
  message.run_id(values.count());
  message.vehicle_id(values.small());
  message.sample_index(values.count());
  message.phase(RunPhase::PHASE_FAILED);
  message.reason(values.text(255));
  message.step(values.count());
  message.controller_name(values.text(32));
  message.real_time_factor(values.real());
  message.round_trip_p50_ns(values.count());
  message.round_trip_p99_ns(values.count());
  message.timing(values.text(128));
  message.problem(values.text(255));
  for (const bus::SyncCounter& counter : bus::kSyncCounters)
    (message.counters().*counter.change)() = values.count();
  return message;
}

}  // namespace sls::test
