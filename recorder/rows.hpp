/// The rows of the CSV files, which hold the recorded, compared and certified data of a step. Each
/// row type lists its columns once, in order.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/bus/names.hpp"
#include "common/bus/sync_counters.hpp"
#include "common/model/forces.hpp"
#include "common/model/step_record.hpp"
#include "recorder/columns.hpp"

namespace sls::record {

/// All rows of one step of one vehicle: its record, and the columns that are made of it.
struct StepRows : model::StepRecord {
  // A file may lack the row of a step. measured.csv has one if `measured` is set.
  bool has_state = false;
  bool has_command = false;
  bool has_reference = false;

  bool has_attitude = false;  ///< true adds the columns of the attitude
  double state_time_s = 0;
  double reference_time_s = 0;
  double compute_us = 0;
  std::string fault;  ///< the error code; kHeld or kFailSafe if no answer was in force
  /// Step at which the stage of the reference began. Only samples contain it, no file does.
  std::optional<std::uint64_t> stage_start_step;

  static constexpr std::string_view kHeld = "held";
  static constexpr std::string_view kFailSafe = "fail_safe";
  bool is_unanswered() const {
    return kind == model::AnswerKind::kHeld || kind == model::AnswerKind::kFailSafe;
  }
  /// True if the three rows exist from which a row of flight.csv is made.
  bool is_complete() const { return has_state && has_command && has_reference; }
  /// True if no row is missing: a step without an answer may have no reference.
  bool is_whole() const { return has_state && has_command && (has_reference || is_unanswered()); }
};

/// The facts of a run that its rows depend on beside its records.
struct RowFormat {
  std::int64_t period_ns = 0;
  bool has_attitude = false;
  int signals = 0;  ///< of every row, even if the record has another number of them
};
RowFormat make_row_format(const Parameters& parameters);

/// Fills the columns and signals of `rows` whose record, of any kind except kLate, is new.
void fill_columns(StepRows& rows, const RowFormat& format);
/// Adds the reference of `late`, a late answer to the step of `rows`.
void add_reference(StepRows& rows, const model::StepRecord& late, const RowFormat& format);

// A row type visits the fields of `rows`. Those of a `Rows` that is not constant are read from a
// file: the visitor writes them.

/// State k: true motion of quadrotor and load, and the force applied over [k − 1, k).
struct StateRow {
  static constexpr const char* kTopic = "sls/state";
  static constexpr const char* kFile = "state.csv";
  static constexpr auto kIsThere = &StepRows::has_state;

  template <class Rows, class Visitor>
  static void visit(Rows& rows, Visitor& field) {
    visit(rows, rows.truth, field);
  }
  template <class Rows, class Motion, class Visitor>
  static void visit(Rows& rows, Motion& motion, Visitor& field) {
    field({"vehicle_id", "", "vehicle", "vehicle_id"}, rows.vehicle_id);
    field({"step", "", "k, counts control periods", "step"}, rows.step);
    field({"sim_time_s", "s", "k × period", "step"}, rows.state_time_s);
    field({"quad_?_m", "m", "position of the quadrotor", "truth.p_WQ_m"}, motion.p_WQ);
    field({"quad_v?_m_s", "m/s", "its velocity", "truth.v_WQ_m_s"}, motion.v_WQ);
    field({"load_?_m", "m", "position of the load", "truth.p_WL_m"}, motion.p_WL);
    field({"load_v?_m_s", "m/s", "its velocity", "truth.v_WL_m_s"}, motion.v_WL);
    field({"alpha_rad", "rad", "angle of the rod about x", "truth"}, motion.rod.alpha);
    field({"beta_rad", "rad", "angle of the rod about y", "truth"}, motion.rod.beta);
    field({"alpha_dot_rad_s", "rad/s", "its rate", "truth"}, motion.rod.alpha_dot);
    field({"beta_dot_rad_s", "rad/s", "its rate", "truth"}, motion.rod.beta_dot);
    field({"force_?_n", "N", "force that acted over [k−1, k)", "f_Q_W_n"}, rows.f_Q_W);
    if (rows.has_attitude) {
      auto& q_WB = motion.attitude.q_WB;
      std::array<double, 4> wxyz = {q_WB.w(), q_WB.x(), q_WB.y(), q_WB.z()};
      field({"att_?", "", "attitude: unit quaternion, body to W", "truth.q_WB"}, wxyz);
      if constexpr (!std::is_const_v<Motion>)
        q_WB = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
      field({"rate_?_rad_s", "rad/s", "body rates, in the body", "truth.w_WB_B_rad_s"},
            motion.attitude.w_WB_B);
    }
    field({"NAME", "its own", "signal of the plant", "truth.signals"}, motion.signals);
  }
};

/// The same columns with the measured state, which must be set.
struct MeasuredRow {
  static constexpr const char* kFile = "measured.csv";

  template <class Rows, class Visitor>
  static void visit(Rows& rows, Visitor& field) {
    StateRow::visit(rows, *rows.measured, field);
  }
};

/// The answer to state k.
struct CommandRow {
  static constexpr const char* kTopic = "sls/command";
  static constexpr const char* kFile = "command.csv";
  static constexpr auto kIsThere = &StepRows::has_command;

  template <class Rows, class Visitor>
  static void visit(Rows& rows, Visitor& field) {
    field({"vehicle_id", "", "vehicle", "vehicle_id"}, rows.vehicle_id);
    field({"step", "", "k", "step"}, rows.step);
    field({"controller", "", "client that sent the answer", "client_name", false},
          rows.client_name);
    field({"force_?_n", "N", "force answered for [k, k+1)", "answer"}, rows.answer.f_Q_W);
    field({"compute_us", "µs", "wall time it took; 0 where held", "answer", false},
          rows.compute_us);
    field({"fault", "", "error code, or `held`, `fail_safe`", "kind"}, rows.fault);
  }
};

/// The reference that the answer to state k follows.
struct ReferenceRow {
  static constexpr const char* kTopic = "sls/reference";
  static constexpr const char* kFile = "reference.csv";
  static constexpr auto kIsThere = &StepRows::has_reference;

  template <class Rows, class Visitor>
  static void visit(Rows& rows, Visitor& field) {
    auto& answer = rows.answer;
    auto& reference = answer.reference;
    field({"vehicle_id", "", "vehicle", "vehicle_id"}, rows.vehicle_id);
    field({"step", "", "k", "step"}, rows.step);
    field({"sim_time_s", "s", "k × period", "step"}, rows.reference_time_s);
    field({"stage", "", "index into the mission", "answer.reference"}, answer.stage);
    field({"stage_name", "", "its name", "answer.reference"}, answer.stage_name);
    field({"ref_?_m", "m", "desired position of the load", "answer.reference"}, reference.position);
    field({"ref_v?_m_s", "m/s", "1st derivative", "answer.reference"}, reference.velocity);
    field({"ref_a?_m_s2", "m/s²", "2nd derivative", "answer.reference"}, reference.acceleration);
    field({"ref_j?_m_s3", "m/s³", "3rd derivative", "answer.reference"}, reference.jerk);
    field({"ref_s?_m_s4", "m/s⁴", "4th derivative", "answer.reference"}, reference.snap);
  }
};

/// The three joined, in the order of the published flight logs.
struct FlightRow {
  static constexpr const char* kFile = "flight.csv";

  const StepRows& rows;
  bool is_of_fleet = false;  ///< true adds the column vehicle_id

  template <class Visitor>
  static void visit(const FlightRow& row, Visitor& field) {
    const StepRows& rows = row.rows;
    const model::Measurement& motion = rows.truth;
    const Eigen::Vector3d& f_Q_W = rows.answer.f_Q_W;
    const model::CommandedAttitude attitude = model::calc_commanded_attitude(f_Q_W);
    const Eigen::Vector3d n_W = (motion.p_WL - motion.p_WQ).normalized();
    field({"sim_time_s", "s", "k × period", "state.csv"}, rows.state_time_s);
    field({"ref_?_m", "m", "desired position of the load", "reference.csv"},
          rows.answer.reference.position);
    field({"quad_?_m", "m", "position of the quadrotor", "state.csv"}, motion.p_WQ);
    field({"roll_rad", "rad", "attitude that realises the force", "force"}, attitude.roll);
    field({"pitch_rad", "rad", "attitude that realises the force", "force"}, attitude.pitch);
    field({"yaw_rad", "rad", "attitude that realises the force", "force"}, attitude.yaw);
    field({"quad_v?_m_s", "m/s", "its velocity", "state.csv"}, motion.v_WQ);
    field({"rod_?", "", "unit vector of the rod", "state.csv"}, n_W);
    field({"alpha_rad", "rad", "angle of the rod about x", "state.csv"}, motion.rod.alpha);
    field({"beta_rad", "rad", "angle of the rod about y", "state.csv"}, motion.rod.beta);
    field({"alpha_dot_rad_s", "rad/s", "its rate", "state.csv"}, motion.rod.alpha_dot);
    field({"beta_dot_rad_s", "rad/s", "its rate", "state.csv"}, motion.rod.beta_dot);
    field({"force_?_n", "N", "force answered", "command.csv"}, f_Q_W);
    if (row.is_of_fleet)
      field({"vehicle_id", "", "vehicle, of a fleet alone", "state.csv"}, rows.vehicle_id);
  }
};

/// A sample of sls/status.
struct StatusRow {
  static constexpr const char* kTopic = "sls/status";
  static constexpr const char* kFile = "status.csv";

  template <class Visitor>
  static void visit(const SimStatus& status, Visitor& field) {
    const auto text = [](const auto& words) { return std::string_view(words.c_str()); };
    const auto to_us = [](std::uint64_t ns) { return static_cast<double>(ns) / 1e3; };
    field({"sample_index", "", "counts samples", "sample_index"}, status.sample_index());
    field({"phase", "", "", "phase"}, std::string_view(bus::to_string(status.phase())));
    field({"reason", "", "of the phase; missing participants, take-overs", "reason"},
          text(status.reason()));
    field({"step", "", "in work", "step"}, status.step());
    field({"controller", "", "client in control", "controller_name"},
          text(status.controller_name()));
    field({"real_time_factor", "", "simulated over wall time", "real_time_factor"},
          status.real_time_factor());
    for (const bus::SyncCounter& counter : bus::kSyncCounters)
      field({counter.name, "", "SyncCounters", "counters"}, (status.counters().*counter.get)());
    field({"round_trip_p50_us", "µs", "median of the last 1,000", "round_trip_p50_ns"},
          to_us(status.round_trip_p50_ns()));
    field({"round_trip_p99_us", "µs", "99th percentile", "round_trip_p99_ns"},
          to_us(status.round_trip_p99_ns()));
    field({"timing", "", "label", "timing"}, text(status.timing()));
    field({"problem", "", "mistakes of participants", "problem"}, text(status.problem()));
  }
};

template <class Row, class Rows = StepRows>
std::vector<ColumnLister::Entry> list_columns(const Rows& rows = Rows()) {
  ColumnLister lister;
  Row::visit(rows, lister);
  return lister.entries;
}

/// The first line of the row's file. For state.csv without attitude and signals.
template <class Row, class Rows = StepRows>
std::string make_header() {
  return join_names(list_columns<Row, Rows>());
}

}  // namespace sls::record
