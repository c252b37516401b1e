/// Description of a run for the page: the same for a live run and for a recording.
#pragma once

#include <string>
#include <vector>

#include "common/bus/topics.hpp"

namespace sls::view {

std::vector<std::string> list_column_names();

/// Columns of the rows that the page gets, always in this order: those of state.csv from the
/// position on, with attitude, and the position of reference.csv; the plant's signals follow. A
/// number that a run does not have is NaN.
inline const std::vector<std::string> kColumns = list_column_names();

/// A JSON object: {"run_id":"16 hex digits","scenario":"figure_eight","mode":"lockstep",
/// "period_s":0.004,"real_time_factor":0,"has_attitude":false,
/// "vehicles":[{"id":0,"quad_mass_kg":…,"load_mass_kg":…,"rod_length_m":…,"attachment_m":[x,y,z],
///              "rotors":[{"position_m":[x,y,z],"spin":1}]}],
/// "columns":[{"name":"quad_x_m","unit":"m"},…],"stages":["climb",…],
/// "load":null,"path_m":[[x,y,z],…]}
/// `load`: of vehicles that carry one load by cables (scene::LoadScene):
/// {"attachments_m":{"0":[x,y,z],
/// …},"outline_m":[[x,y,z],…],"full_tension_n":…,"ground_z_m":null,"colours":{"slack":[r,g,b],"low":…,
/// "high":…}}, positions in the load.
/// `path_m`: the planned path of vehicle 0's load, or of the centre of the one load, at most 2,000
/// points; frame W, z down. A point
/// mass has four rotors that are drawn but not simulated, and "is_drawn_only":true in its vehicle.
/// @throws config::ConfigError if the scenario text is not a valid scenario.
std::string describe_run(const Parameters& parameters);

}  // namespace sls::view
