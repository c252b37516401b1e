/// The columns of each CSV file and how a sample becomes a row.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/bus/topics.hpp"
#include "recorder/csv_file.hpp"

namespace sls::record {

inline constexpr std::string_view kStateHeader =
    "vehicle_id,step,sim_time_s,quad_x_m,quad_y_m,quad_z_m,quad_vx_m_s,quad_vy_m_s,quad_vz_m_s,"
    "load_x_m,load_y_m,load_z_m,load_vx_m_s,load_vy_m_s,load_vz_m_s,"
    "alpha_rad,beta_rad,alpha_dot_rad_s,beta_dot_rad_s,force_x_n,force_y_n,force_z_n";
inline constexpr std::string_view kCommandHeader =
    "vehicle_id,step,controller,force_x_n,force_y_n,force_z_n,compute_us,fault";
inline constexpr std::string_view kReferenceHeader =
    "vehicle_id,step,sim_time_s,stage,stage_name,ref_x_m,ref_y_m,ref_z_m,"
    "ref_vx_m_s,ref_vy_m_s,ref_vz_m_s,ref_ax_m_s2,ref_ay_m_s2,ref_az_m_s2,"
    "ref_jx_m_s3,ref_jy_m_s3,ref_jz_m_s3,ref_sx_m_s4,ref_sy_m_s4,ref_sz_m_s4";
inline constexpr std::string_view kStatusHeader =
    "sample_index,phase,reason,step,controller,real_time_factor,resent,late,duplicate,superseded,"
    "take_overs,rejected_not_finite,rejected_force_limit,rejected_run,rejected_step,"
    "rejected_vehicle,rejected_client,rejected_fault";
/// In the order of the published flight logs.
inline constexpr std::string_view kFlightHeader =
    "sim_time_s,ref_x_m,ref_y_m,ref_z_m,quad_x_m,quad_y_m,quad_z_m,roll_rad,pitch_rad,yaw_rad,"
    "quad_vx_m_s,quad_vy_m_s,quad_vz_m_s,rod_x,rod_y,rod_z,alpha_rad,beta_rad,alpha_dot_rad_s,"
    "beta_dot_rad_s,force_x_n,force_y_n,force_z_n";

void write_row(CsvFile& file, const VehicleState& state);
void write_row(CsvFile& file, const ControlCommand& command);
void write_row(CsvFile& file, const Reference& reference);
void write_row(CsvFile& file, const SimStatus& status);

/// Row of flight.csv: the state of a step, the reference it was to follow and the force answered.
void write_flight_row(CsvFile& file, const VehicleState& state, const ControlCommand& command,
                      const Reference& reference);

}  // namespace sls::record
