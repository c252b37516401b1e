#include "tests/system/fleet_flight.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "closed_loop/flight.hpp"

namespace sls::test {
namespace {

constexpr const char* kFleet = R"(name: fleet_test
vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }
vehicles:
  - {}
  - { offset_m: [5, 0, 0] }
  - { offset_m: [10, 0, 0], load_mass_kg: 0.3 }
  - { offset_m: [0, 5, 0], quad_mass_kg: 1.2, rod_length_m: 0.7 }
  - { offset_m: [5, 5, -1], quad_mass_kg: 2, load_mass_kg: 0.2, rod_length_m: 1.5 }
  - { offset_m: [10.3, 5.7, 0.1], rod_length_m: 0.8 }
plant: { initial: { load_position_m: [0, 0, -0.5] } }
sync: { period_s: 0.004, wait_for: { controllers: 1, recorders: 1, timeout_s: 30 } }
controller: { model: { load_mass_kg: 0.25 } }
mission:
  - set_point: { position_m: [1, -1, -2] }
    until: { within_m: 0.3 }
  - set_point: { position_m: [0, 0, -1] }
    for_s: 0.4
)";

/// Row numbers of one vehicle.
std::vector<std::size_t> find_rows(const Table& table, std::uint32_t id) {
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < table.rows(); ++row)
    if (table.text(row, "vehicle_id") == std::to_string(id)) rows.push_back(row);
  return rows;
}

}  // namespace

std::string make_fleet_scenario(const TemporaryFolder& folder,
                                const std::vector<std::pair<std::string, std::string>>& changes) {
  std::string text = kFleet;
  for (const auto& [from, to] : changes) text = replace_once(text, from, to);
  const std::string file = folder / "fleet.yaml";
  write_bytes(file, text);
  return file;
}

void expect_each_flies_as_alone(const std::filesystem::path& recording,
                                const std::string& scenario_file,
                                const std::vector<std::uint32_t>& ids) {
  const config::Scenario fleet = config::load_scenario(scenario_file);
  const Table states(recording / "state.csv"), commands(recording / "command.csv"),
      references(recording / "reference.csv");
  std::size_t longest = 0;
  for (const std::uint32_t id : ids) {
    SCOPED_TRACE("vehicle " + std::to_string(id));
    const auto flown = closed_loop::fly(fleet, id);
    const auto state_rows = find_rows(states, id), command_rows = find_rows(commands, id),
               reference_rows = find_rows(references, id);
    ASSERT_GE(state_rows.size(), flown.size());
    ASSERT_EQ(command_rows.size(), state_rows.size());
    ASSERT_EQ(reference_rows.size(), state_rows.size());
    for (std::size_t step = 0; step < flown.size(); ++step) {
      const std::size_t s = state_rows[step], c = command_rows[step];
      ASSERT_EQ(states.number(s, "step"), static_cast<double>(step));
      ASSERT_EQ(commands.number(c, "step"), static_cast<double>(step));
      ASSERT_EQ(references.position(reference_rows[step], "ref"),
                flown[step].answer.reference.position);
      ASSERT_EQ(states.position(s, "quad"), flown[step].truth.p_WQ) << "step " << step;
      ASSERT_EQ(states.position(s, "load"), flown[step].truth.p_WL) << "step " << step;
      ASSERT_EQ(states.number(s, "load_vx_m_s"), flown[step].truth.v_WL.x()) << "step " << step;
      ASSERT_EQ(states.number(s, "force_x_n"), flown[step].f_Q_W.x()) << "step " << step;
      ASSERT_EQ(commands.number(c, "force_x_n"), flown[step].answer.f_Q_W.x()) << "step " << step;
      ASSERT_EQ(commands.number(c, "force_z_n"), flown[step].answer.f_Q_W.z()) << "step " << step;
    }
    longest = std::max(longest, flown.size());
  }
  EXPECT_EQ(states.rows(), ids.size() * longest);
}

}  // namespace sls::test
