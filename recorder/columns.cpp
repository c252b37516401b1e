#include "recorder/columns.hpp"

#include "common/bus/convert.hpp"
#include "common/bus/names.hpp"
#include "common/model/forces.hpp"

namespace sls::record {
namespace {

double to_seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) / 1e9; }

}  // namespace

void write_row(CsvFile& file, const VehicleState& state) {
  file.add(state.vehicle_id());
  file.add(state.step());
  file.add(to_seconds(state.sim_time_ns()));
  file.add_all(state.p_WQ_m());
  file.add_all(state.v_WQ_m_s());
  file.add_all(state.p_WL_m());
  file.add_all(state.v_WL_m_s());
  file.add(state.alpha_rad());
  file.add(state.beta_rad());
  file.add(state.alpha_dot_rad_s());
  file.add(state.beta_dot_rad_s());
  file.add_all(state.f_Q_W_n());
  file.end_row();
}

void write_row(CsvFile& file, const ControlCommand& command) {
  file.add(command.vehicle_id());
  file.add(command.step());
  file.add(command.client_name().c_str());
  file.add_all(command.f_Q_W_n());
  file.add(static_cast<double>(command.compute_time_ns()) / 1e3);
  file.add(bus::to_string(command.fault()));
  file.end_row();
}

void write_row(CsvFile& file, const Reference& reference) {
  file.add(reference.vehicle_id());
  file.add(reference.step());
  file.add(to_seconds(reference.sim_time_ns()));
  file.add(reference.stage_index());
  file.add(reference.stage_name().c_str());
  file.add_all(reference.position_m());
  file.add_all(reference.velocity_m_s());
  file.add_all(reference.acceleration_m_s2());
  file.add_all(reference.jerk_m_s3());
  file.add_all(reference.snap_m_s4());
  file.end_row();
}

void write_row(CsvFile& file, const SimStatus& status) {
  const SyncCounters& counters = status.counters();
  file.add(status.sample_index());
  file.add(bus::to_string(status.phase()));
  file.add(status.reason().c_str());
  file.add(status.step());
  file.add(status.controller_name().c_str());
  file.add(status.real_time_factor());
  for (const auto count :
       {counters.resent(), counters.late(), counters.duplicate(), counters.superseded(),
        counters.take_overs(), counters.rejected_not_finite(), counters.rejected_force_limit(),
        counters.rejected_run(), counters.rejected_step(), counters.rejected_vehicle(),
        counters.rejected_client(), counters.rejected_fault()})
    file.add(count);
  file.end_row();
}

void write_flight_row(CsvFile& file, const VehicleState& state, const ControlCommand& command,
                      const Reference& reference) {
  const Eigen::Vector3d f_Q_W = bus::to_vector(command.f_Q_W_n());
  const model::CommandedAttitude attitude = model::calc_commanded_attitude(f_Q_W);
  const Eigen::Vector3d n_W =
      (bus::to_vector(state.p_WL_m()) - bus::to_vector(state.p_WQ_m())).normalized();
  file.add(to_seconds(state.sim_time_ns()));
  file.add_all(reference.position_m());
  file.add_all(state.p_WQ_m());
  file.add(attitude.roll);
  file.add(attitude.pitch);
  file.add(attitude.yaw);
  file.add_all(state.v_WQ_m_s());
  file.add_all(n_W);
  file.add(state.alpha_rad());
  file.add(state.beta_rad());
  file.add(state.alpha_dot_rad_s());
  file.add(state.beta_dot_rad_s());
  file.add_all(f_Q_W);
  file.end_row();
}

}  // namespace sls::record
