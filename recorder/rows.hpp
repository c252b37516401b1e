/// The rows of the CSV files: what is recorded of a step, and what is compared and certified. Each
/// row type lists its columns once, in their order.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/bus/names.hpp"
#include "common/bus/sync_counters.hpp"
#include "recorder/columns.hpp"

namespace sls::record {

using Numbers3 = std::array<double, 3>;

/// State k: what quadrotor and load really do, and the force applied over [k − 1, k).
struct StateRow {
  static constexpr const char* kTopic = "sls/state";
  static constexpr const char* kFile = "state.csv";
  static constexpr const char* kMeasuredFile = "measured.csv";  // the same of what was measured

  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  double sim_time_s = 0;
  Numbers3 p_WQ{}, v_WQ{}, p_WL{}, v_WL{};
  double alpha = 0, beta = 0, alpha_dot = 0, beta_dot = 0;
  Numbers3 f_Q_W{};
  std::vector<double> further;  ///< attitude, body rates and signals, where the run has them

  template <class Row, class Visitor>
  static void visit(Row& row, Visitor& field) {
    field(Column{"vehicle_id", "", "vehicle", "vehicle_id"}, row.vehicle_id);
    field(Column{"step", "", "k, counts control periods", "step"}, row.step);
    field(Column{"sim_time_s", "s", "k × period", "step"}, row.sim_time_s);
    field(Column{"quad_?_m", "m", "position of the quadrotor", "truth.p_WQ_m"}, row.p_WQ);
    field(Column{"quad_v?_m_s", "m/s", "its velocity", "truth.v_WQ_m_s"}, row.v_WQ);
    field(Column{"load_?_m", "m", "position of the load", "truth.p_WL_m"}, row.p_WL);
    field(Column{"load_v?_m_s", "m/s", "its velocity", "truth.v_WL_m_s"}, row.v_WL);
    field(Column{"alpha_rad", "rad", "angle of the rod about x", "truth.alpha_rad"}, row.alpha);
    field(Column{"beta_rad", "rad", "angle of the rod about y", "truth.beta_rad"}, row.beta);
    field(Column{"alpha_dot_rad_s", "rad/s", "its rate", "truth.alpha_dot_rad_s"}, row.alpha_dot);
    field(Column{"beta_dot_rad_s", "rad/s", "its rate", "truth.beta_dot_rad_s"}, row.beta_dot);
    field(Column{"force_?_n", "N", "force that acted over [k−1, k)", "f_Q_W_n"}, row.f_Q_W);
    field(Column{}, row.further);
  }
};

/// The answer to state k, as it was answered.
struct CommandRow {
  static constexpr const char* kTopic = "sls/command";
  static constexpr const char* kFile = "command.csv";

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
    field(Column{"vehicle_id", "", "vehicle", "vehicle_id"}, row.vehicle_id);
    field(Column{"step", "", "k", "step"}, row.step);
    field(Column{"controller", "", "whose answer", "client_name", false}, row.controller);
    field(Column{"force_?_n", "N", "force answered for [k, k+1)", "answer.f_Q_W_n"}, row.f_Q_W);
    field(Column{"compute_us", "µs", "wall time it took; 0 where held", "answer.compute_time_ns",
                 false},
          row.compute_us);
    field(Column{"fault", "", "error code, or `held`, `fail_safe`", "answer.fault, kind"},
          row.fault);
  }
};

/// What the answer to state k follows.
struct ReferenceRow {
  static constexpr const char* kTopic = "sls/reference";
  static constexpr const char* kFile = "reference.csv";

  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  double sim_time_s = 0;
  std::uint32_t stage = 0;
  std::string stage_name;
  Numbers3 position{}, velocity{}, acceleration{}, jerk{}, snap{};

  template <class Row, class Visitor>
  static void visit(Row& row, Visitor& field) {
    field(Column{"vehicle_id", "", "vehicle", "vehicle_id"}, row.vehicle_id);
    field(Column{"step", "", "k", "step"}, row.step);
    field(Column{"sim_time_s", "s", "k × period", "step"}, row.sim_time_s);
    field(Column{"stage", "", "index into the mission", "answer.reference.stage_index"}, row.stage);
    field(Column{"stage_name", "", "its name", "answer.reference.stage_name"}, row.stage_name);
    field(Column{"ref_?_m", "m", "desired position of the load", "answer.reference.position_m"},
          row.position);
    field(Column{"ref_v?_m_s", "m/s", "1st derivative", "answer.reference.velocity_m_s"},
          row.velocity);
    field(Column{"ref_a?_m_s2", "m/s²", "2nd derivative", "answer.reference.acceleration_m_s2"},
          row.acceleration);
    field(Column{"ref_j?_m_s3", "m/s³", "3rd derivative", "answer.reference.jerk_m_s3"}, row.jerk);
    field(Column{"ref_s?_m_s4", "m/s⁴", "4th derivative", "answer.reference.snap_m_s4"}, row.snap);
  }
};

/// The three joined, in the order of the published flight logs.
struct FlightRow {
  static constexpr const char* kFile = "flight.csv";

  double sim_time_s = 0;
  Numbers3 p_WL_ref{}, p_WQ{};
  double roll = 0, pitch = 0, yaw = 0;
  Numbers3 v_WQ{}, n_W{};
  double alpha = 0, beta = 0, alpha_dot = 0, beta_dot = 0;
  Numbers3 f_Q_W{};

  template <class Row, class Visitor>
  static void visit(Row& row, Visitor& field) {
    field(Column{"sim_time_s", "s", "k × period", "state.csv"}, row.sim_time_s);
    field(Column{"ref_?_m", "m", "desired position of the load", "reference.csv"}, row.p_WL_ref);
    field(Column{"quad_?_m", "m", "position of the quadrotor", "state.csv"}, row.p_WQ);
    field(Column{"roll_rad", "rad", "attitude that realises the force", "force"}, row.roll);
    field(Column{"pitch_rad", "rad", "attitude that realises the force", "force"}, row.pitch);
    field(Column{"yaw_rad", "rad", "attitude that realises the force", "force"}, row.yaw);
    field(Column{"quad_v?_m_s", "m/s", "velocity of the quadrotor", "state.csv"}, row.v_WQ);
    field(Column{"rod_?", "", "unit vector from quadrotor to load", "positions"}, row.n_W);
    field(Column{"alpha_rad", "rad", "angle of the rod about x", "state.csv"}, row.alpha);
    field(Column{"beta_rad", "rad", "angle of the rod about y", "state.csv"}, row.beta);
    field(Column{"alpha_dot_rad_s", "rad/s", "its rate", "state.csv"}, row.alpha_dot);
    field(Column{"beta_dot_rad_s", "rad/s", "its rate", "state.csv"}, row.beta_dot);
    field(Column{"force_?_n", "N", "force answered", "command.csv"}, row.f_Q_W);
  }
};

/// A sample of sls/status.
struct StatusRow {
  static constexpr const char* kTopic = "sls/status";
  static constexpr const char* kFile = "status.csv";

  SimStatus status;

  template <class Row, class Visitor>
  static void visit(Row& row, Visitor& field) {
    const SimStatus& status = row.status;
    const auto to_us = [](std::uint64_t ns) { return static_cast<double>(ns) / 1e3; };
    field(Column{"sample_index", "", "counts samples", "sample_index"}, status.sample_index());
    field(Column{"phase", "", "", "phase"}, std::string_view(bus::to_string(status.phase())));
    field(Column{"reason", "", "why, and what happened", "reason"},
          std::string_view(status.reason().c_str()));
    field(Column{"step", "", "in work", "step"}, status.step());
    field(Column{"controller", "", "who flies", "controller_name"},
          std::string_view(status.controller_name().c_str()));
    field(Column{"real_time_factor", "", "simulated over wall time", "real_time_factor"},
          status.real_time_factor());
    for (const bus::SyncCounter& counter : bus::kSyncCounters)
      field(Column{counter.name, "", "SyncCounters", "counters"},
            (status.counters().*counter.get)());
    field(Column{"round_trip_p50_us", "µs", "median of the last 1,000", "round_trip_p50_ns"},
          to_us(status.round_trip_p50_ns()));
    field(Column{"round_trip_p99_us", "µs", "99th percentile", "round_trip_p99_ns"},
          to_us(status.round_trip_p99_ns()));
    field(Column{"timing", "", "label", "timing"}, std::string_view(status.timing().c_str()));
    field(Column{"problem", "", "what a participant does wrong", "problem"},
          std::string_view(status.problem().c_str()));
  }
};

/// The rows there are of one step of one vehicle.
struct StepRows {
  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  std::optional<StateRow> state;
  std::optional<StateRow> measured;  ///< where it can differ from the truth
  std::optional<CommandRow> command;
  std::optional<ReferenceRow> reference;
  /// Step at which the stage of `reference` began; only samples tell, no file.
  std::optional<std::uint64_t> stage_start_step;

  /// All three: what a row of flight.csv is made of.
  bool is_complete() const { return state && command && reference; }
  /// All that can be had: a step that nobody answered may have no reference.
  bool is_whole() const { return state && command && (reference || command->is_unanswered()); }
};

/// What an entry of any kind but ANSWER_LATE brings.
StepRows make_rows(const RecordEntry& entry, const Parameters& parameters);
/// Adds the reference of `entry`, the answer to that step.
void add_reference(StepRows& rows, const RecordEntry& entry, const Parameters& parameters);

/// Of a step that is complete.
FlightRow make_flight_row(const StepRows& rows);

}  // namespace sls::record
