#include "tools/view/run_description.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/bus/names.hpp"
#include "common/config/model_keys.hpp"
#include "common/scene/load_scene.hpp"
#include "control_client/reference_trajectory.hpp"
#include "recorder/rows.hpp"

namespace sls::view {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostPathPoints = 2000;
constexpr std::size_t kCurvePoints = 200;  // of a stage whose reference moves
constexpr double kDrawnArm = 0.15;         // m, along x and y: rotors of a point mass

Json to_json(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

// --- vehicles ------------------------------------------------------------------------------------

Json describe_vehicles(const Parameters& parameters, const config::Scenario& scenario) {
  const config::Plant& plant = scenario.plant;
  config::VehicleShape shape =
      find_model_keys(config::all_models().plants, plant.model).calc_shape(plant);
  const bool is_drawn_only = shape.rotors.empty();
  if (is_drawn_only)
    for (const auto& [x, y, spin] :
         {std::array{1, 1, 1}, std::array{-1, -1, 1}, std::array{1, -1, -1}, std::array{-1, 1, -1}})
      shape.rotors.push_back({{x * kDrawnArm, y * kDrawnArm, 0.0}, spin});
  Json rotors = Json::array();
  for (const auto& rotor : shape.rotors)
    rotors.push_back({{"position_m", to_json(rotor.position)}, {"spin", rotor.spin}});
  Json vehicles = Json::array();
  for (const VehicleParameters& vehicle : parameters.vehicles()) {
    Json json = {{"id", vehicle.vehicle_id()},
                 {"quad_mass_kg", vehicle.quad_mass_kg()},
                 {"load_mass_kg", vehicle.load_mass_kg()},
                 {"rod_length_m", vehicle.rod_length_m()},
                 {"attachment_m", to_json(shape.attachment)},
                 {"rotors", rotors}};
    if (is_drawn_only) json["is_drawn_only"] = true;
    vehicles.push_back(std::move(json));
  }
  return vehicles;
}

/// The load that the vehicles carry together by cables; null: each has its own on a rod.
Json describe_load(const Parameters& parameters) {
  const auto scene = scene::read_load_scene(parameters);
  if (!scene) return nullptr;
  Json attachments = Json::object(), outline = Json::array();
  for (const auto& [id, attachment] : scene->attachments_L)
    attachments[std::to_string(id)] = to_json(attachment);
  for (const Eigen::Vector3d& point : scene->outline_L) outline.push_back(to_json(point));
  return {
      {"attachments_m", std::move(attachments)},
      {"outline_m", std::move(outline)},
      {"full_tension_n", scene->full_tension},
      {"ground_z_m", scene->ground_z_W ? Json(*scene->ground_z_W) : Json()},
      {"colours",
       {{"slack", scene::kSlackColour}, {"low", scene::kLowColour}, {"high", scene::kHighColour}}}};
}

// --- columns -------------------------------------------------------------------------------------

std::vector<record::ColumnLister::Entry> list_columns() {
  record::StepRows rows;
  rows.has_attitude = true;
  auto columns = record::list_columns<record::StateRow>(rows);
  columns.erase(columns.begin(), columns.begin() + 3);  // rows have vehicle and time of their own
  for (const auto& column : record::list_columns<record::ReferenceRow>())
    if (column.names.front() == "ref_x_m") columns.push_back(column);
  return columns;
}

Json describe_columns(const Parameters& parameters) {
  Json columns = Json::array();
  for (const auto& [column, names] : list_columns())
    for (const std::string& name : names)
      columns.push_back({{"name", name}, {"unit", *column.unit ? column.unit : "1"}});
  for (const SignalDescription& signal : parameters.signals())
    columns.push_back({{"name", signal.name().to_string()}, {"unit", signal.unit().to_string()}});
  return columns;
}

// --- mission -------------------------------------------------------------------------------------

/// Time for which the reference of a stage moves, s: until the end of the stage, for a figure eight
/// at most one lap. 0: it does not move.
double calc_moving_time(const config::Stage& stage) {
  double longest = 0;
  if (const auto* eight = std::get_if<config::FigureEightReference>(&stage.reference))
    longest = eight->period_s;
  else if (const auto* rest = std::get_if<config::RestToRestReference>(&stage.reference))
    longest = rest->duration_s;
  if (const auto* after = std::get_if<config::LeaveAfter>(&stage.leave))
    longest = std::min(longest, static_cast<double>(after->duration_ns) * 1e-9);
  return longest;
}

Json describe_path(const config::Scenario& scenario) {
  Json path = Json::array();
  const std::size_t stages = std::max<std::size_t>(scenario.mission.size(), 1);
  const std::size_t most = std::clamp<std::size_t>(kMostPathPoints / stages, 2, kCurvePoints + 1);
  for (const config::Stage& stage : scenario.mission) {
    const double duration = calc_moving_time(stage);
    const auto trajectory = control::make_reference_trajectory(stage.reference);
    const std::size_t points = duration > 0 ? most : 1;
    for (std::size_t i = 0; i < points && path.size() < kMostPathPoints; ++i) {
      const double time =
          points == 1 ? 0 : duration * static_cast<double>(i) / static_cast<double>(points - 1);
      path.push_back(to_json(trajectory->calc(time).position));
    }
  }
  return path;
}

}  // namespace

std::vector<std::string> list_column_names() {
  std::vector<std::string> all;
  for (const auto& [column, names] : list_columns())
    all.insert(all.end(), names.begin(), names.end());
  return all;
}

std::string describe_run(const Parameters& parameters) {
  const std::string run_id = fmt::format("{:016x}", parameters.run_id());
  const config::Scenario scenario =
      config::parse_scenario(parameters.scenario_text().to_string(), "scenario of run " + run_id);
  Json stages = Json::array();
  for (const config::Stage& stage : scenario.mission) stages.push_back(stage.name);
  const bool is_realtime = parameters.mode() == SyncMode::MODE_REALTIME;
  const Json run = {
      {"run_id", run_id},
      {"scenario", scenario.name},
      {"mode", bus::to_string(parameters.mode())},
      {"period_s", static_cast<double>(parameters.period_ns()) * 1e-9},
      {"real_time_factor", is_realtime ? parameters.real_time_factor() : 0.0},
      {"has_attitude", parameters.has_attitude()},
      {"vehicles", describe_vehicles(parameters, scenario)},
      {"columns", describe_columns(parameters)},
      {"stages", std::move(stages)},
      {"load", describe_load(parameters)},
      {"path_m", describe_path(scenario.shared_load ? scenario
                                                    : config::make_vehicle_scenario(scenario, 0))}};
  return run.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace sls::view
