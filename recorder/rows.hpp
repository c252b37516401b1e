/// The rows of state.csv, command.csv and reference.csv: what is recorded of a step, and what is
/// compared and certified. Each row type lists its fields once, in the order of the columns, for
/// whoever writes, reads, hashes or compares them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "recorder/step_join.hpp"

namespace sls::record {

using Numbers3 = std::array<double, 3>;

/// State k: what quadrotor and load really do, and the force applied over [k − 1, k).
struct StateRow {
  static constexpr const char* kTopic = "sls/state";
  static constexpr const char* kFile = "state.csv";
  static constexpr std::string_view kHeader =
      "vehicle_id,step,sim_time_s,quad_x_m,quad_y_m,quad_z_m,quad_vx_m_s,quad_vy_m_s,quad_vz_m_s,"
      "load_x_m,load_y_m,load_z_m,load_vx_m_s,load_vy_m_s,load_vz_m_s,"
      "alpha_rad,beta_rad,alpha_dot_rad_s,beta_dot_rad_s,force_x_n,force_y_n,force_z_n";

  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  double sim_time_s = 0;
  Numbers3 p_WQ{}, v_WQ{}, p_WL{}, v_WL{};
  double alpha = 0, beta = 0, alpha_dot = 0, beta_dot = 0;
  Numbers3 f_Q_W{};

  template <class Row, class Visitor>
  static void visit(Row& row, Visitor& field) {
    field(row.vehicle_id);
    field(row.step);
    field(row.sim_time_s);
    for (auto* vector : {&row.p_WQ, &row.v_WQ, &row.p_WL, &row.v_WL})
      for (auto& number : *vector) field(number);
    for (auto* angle : {&row.alpha, &row.beta, &row.alpha_dot, &row.beta_dot}) field(*angle);
    for (auto& number : row.f_Q_W) field(number);
  }
};

/// The answer to state k, as it was answered.
struct CommandRow {
  static constexpr const char* kTopic = "sls/command";
  static constexpr const char* kFile = "command.csv";
  static constexpr std::string_view kHeader =
      "vehicle_id,step,controller,force_x_n,force_y_n,force_z_n,compute_us,fault";

  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  std::string controller;
  Numbers3 f_Q_W{};
  double compute_us = 0;
  std::string fault;  ///< the fault code; kHeld or kFailSafe where no answer was in force

  static constexpr std::string_view kHeld = "held";
  static constexpr std::string_view kFailSafe = "fail_safe";
  bool is_unanswered() const { return fault == kHeld || fault == kFailSafe; }

  template <class Row, class Visitor>
  static void visit(Row& row, Visitor& field) {
    field(row.vehicle_id);
    field(row.step);
    field.incidental(row.controller);  // differs between equal flights
    for (auto& number : row.f_Q_W) field(number);
    field.incidental(row.compute_us);
    field(row.fault);
  }
};

/// What the answer to state k follows.
struct ReferenceRow {
  static constexpr const char* kTopic = "sls/reference";
  static constexpr const char* kFile = "reference.csv";
  static constexpr std::string_view kHeader =
      "vehicle_id,step,sim_time_s,stage,stage_name,ref_x_m,ref_y_m,ref_z_m,"
      "ref_vx_m_s,ref_vy_m_s,ref_vz_m_s,ref_ax_m_s2,ref_ay_m_s2,ref_az_m_s2,"
      "ref_jx_m_s3,ref_jy_m_s3,ref_jz_m_s3,ref_sx_m_s4,ref_sy_m_s4,ref_sz_m_s4";

  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  double sim_time_s = 0;
  std::uint32_t stage = 0;
  std::string stage_name;
  std::array<Numbers3, 5> derivatives{};  ///< position, velocity, acceleration, jerk, snap

  const Numbers3& position() const { return derivatives[0]; }

  template <class Row, class Visitor>
  static void visit(Row& row, Visitor& field) {
    field(row.vehicle_id);
    field(row.step);
    field(row.sim_time_s);
    field(row.stage);
    field(row.stage_name);
    for (auto& vector : row.derivatives)
      for (auto& number : vector) field(number);
  }
};

/// The rows there are of one step of one vehicle.
struct StepRows {
  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  std::optional<StateRow> state;
  std::optional<CommandRow> command;
  std::optional<ReferenceRow> reference;
  /// Step at which the stage of `reference` began; only samples tell, no file.
  std::optional<std::uint64_t> stage_start_step;

  /// All three: what a row of flight.csv is made of.
  bool is_complete() const { return state && command && reference; }
  /// All that can be had: a step that nobody answered may have no reference.
  bool is_whole() const { return state && command && (reference || command->is_unanswered()); }
};

StepRows make_rows(std::uint32_t vehicle_id, const StepRecord& record);

}  // namespace sls::record
