/// How rows and status samples become lines of the CSV files.
#pragma once

#include <string>
#include <string_view>

#include "common/bus/topics.hpp"
#include "recorder/csv_file.hpp"
#include "recorder/rows.hpp"

namespace sls::record {

inline constexpr const char* kStatusFile = "status.csv";
inline constexpr const char* kStatusTopic = "sls/status";
std::string make_status_header();

/// In the order of the published flight logs.
inline constexpr std::string_view kFlightHeader =
    "sim_time_s,ref_x_m,ref_y_m,ref_z_m,quad_x_m,quad_y_m,quad_z_m,roll_rad,pitch_rad,yaw_rad,"
    "quad_vx_m_s,quad_vy_m_s,quad_vz_m_s,rod_x,rod_y,rod_z,alpha_rad,beta_rad,alpha_dot_rad_s,"
    "beta_dot_rad_s,force_x_n,force_y_n,force_z_n";
/// That, and of a fleet, whose rows one must be able to tell apart, the vehicle.
std::string make_flight_header(bool is_of_fleet);

void write_row(CsvFile& file, const StateRow& row);
void write_row(CsvFile& file, const CommandRow& row);
void write_row(CsvFile& file, const ReferenceRow& row);
void write_row(CsvFile& file, const SimStatus& status);

/// Row of flight.csv: the state of a step, the reference it was to follow and the force answered;
/// in a fleet, whose it is.
void write_flight_row(CsvFile& file, const StateRow& state, const CommandRow& command,
                      const ReferenceRow& reference, bool is_of_fleet);

}  // namespace sls::record
