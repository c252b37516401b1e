/// Description of a run for the page: the same for a live run and for a recording.
#pragma once

#include <string>
#include <vector>

#include "common/bus/topics.hpp"

namespace sls::view {

/// Columns of the rows that the page gets, named as in state.csv and reference.csv, always in this
/// order; the plant's signals follow. A number that a run does not have is NaN.
inline const std::vector<std::string> kColumns = {
    "quad_x_m",       "quad_y_m",    "quad_z_m",  "quad_vx_m_s",  "quad_vy_m_s",
    "quad_vz_m_s",    "load_x_m",    "load_y_m",  "load_z_m",     "load_vx_m_s",
    "load_vy_m_s",    "load_vz_m_s", "alpha_rad", "beta_rad",     "alpha_dot_rad_s",
    "beta_dot_rad_s", "force_x_n",   "force_y_n", "force_z_n",    "att_w",
    "att_x",          "att_y",       "att_z",     "rate_x_rad_s", "rate_y_rad_s",
    "rate_z_rad_s",   "ref_x_m",     "ref_y_m",   "ref_z_m"};

/// A JSON object: {"run_id":"16 hex digits","scenario":"figure_eight","mode":"lockstep",
/// "period_s":0.004,"real_time_factor":0,"has_attitude":false,
/// "vehicles":[{"id":0,"quad_mass_kg":…,"load_mass_kg":…,"rod_length_m":…,"attachment_m":[x,y,z],
///              "rotors":[{"position_m":[x,y,z],"spin":1}]}],
/// "columns":[{"name":"quad_x_m","unit":"m"},…],"stages":["climb",…],
/// "path_m":[[x,y,z],…]}
/// `path_m`: the planned path of vehicle 0's load, at most 2,000 points; frame W, z down. A point
/// mass has four rotors that are drawn but not simulated, and "is_drawn_only":true in its vehicle.
/// @throws config::ConfigError if the scenario text is not a valid scenario.
std::string describe_run(const Parameters& parameters);

}  // namespace sls::view
