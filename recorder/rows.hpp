/// The rows of the CSV files, which hold the recorded, compared and certified data of a step. Each
/// row type lists its columns once, in order.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/bus/convert.hpp"
#include "common/bus/names.hpp"
#include "common/bus/sync_counters.hpp"
#include "common/model/forces.hpp"
#include "recorder/columns.hpp"

namespace sls::record {

using Numbers3 = std::array<double, 3>;

/// State k: true motion of quadrotor and load, and the force applied over [k − 1, k).
struct StateRow {
  static constexpr const char* kTopic = "sls/state";
  static constexpr const char* kFile = "state.csv";
  static constexpr const char* kMeasuredFile = "measured.csv";  // same columns, measured state

  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  double sim_time_s = 0;
  PlantState plant;
  Numbers3 f_Q_W{};
  bool has_attitude = false;

  template <class Row, class Visitor>
  static void visit(Row& row, Visitor& field) {
    auto& plant = row.plant;
    field({"vehicle_id", "", "vehicle", "vehicle_id"}, row.vehicle_id);
    field({"step", "", "k, counts control periods", "step"}, row.step);
    field({"sim_time_s", "s", "k × period", "step"}, row.sim_time_s);
    field({"quad_?_m", "m", "position of the quadrotor", "truth.p_WQ_m"}, plant.p_WQ_m());
    field({"quad_v?_m_s", "m/s", "its velocity", "truth.v_WQ_m_s"}, plant.v_WQ_m_s());
    field({"load_?_m", "m", "position of the load", "truth.p_WL_m"}, plant.p_WL_m());
    field({"load_v?_m_s", "m/s", "its velocity", "truth.v_WL_m_s"}, plant.v_WL_m_s());
    field({"alpha_rad", "rad", "angle of the rod about x", "truth"}, plant.alpha_rad());
    field({"beta_rad", "rad", "angle of the rod about y", "truth"}, plant.beta_rad());
    field({"alpha_dot_rad_s", "rad/s", "its rate", "truth"}, plant.alpha_dot_rad_s());
    field({"beta_dot_rad_s", "rad/s", "its rate", "truth"}, plant.beta_dot_rad_s());
    field({"force_?_n", "N", "force that acted over [k−1, k)", "f_Q_W_n"}, row.f_Q_W);
    if (row.has_attitude) {
      field({"att_?", "", "attitude: unit quaternion, body to W", "truth.q_WB"}, plant.q_WB());
      field({"rate_?_rad_s", "rad/s", "body rates, in the body", "truth.w_WB_B_rad_s"},
            plant.w_WB_B_rad_s());
    }
    field({"NAME", "its own", "signal of the plant", "truth.signals"}, plant.signals());
  }
};

/// The answer to state k.
struct CommandRow {
  static constexpr const char* kTopic = "sls/command";
  static constexpr const char* kFile = "command.csv";

  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  std::string controller;
  Numbers3 f_Q_W{};
  double compute_us = 0;
  std::string fault;  ///< the fault code; kHeld or kFailSafe if no answer was in force

  static constexpr std::string_view kHeld = "held";
  static constexpr std::string_view kFailSafe = "fail_safe";
  bool is_unanswered() const { return fault == kHeld || fault == kFailSafe; }

  template <class Row, class Visitor>
  static void visit(Row& row, Visitor& field) {
    field({"vehicle_id", "", "vehicle", "vehicle_id"}, row.vehicle_id);
    field({"step", "", "k", "step"}, row.step);
    field({"controller", "", "client that sent the answer", "client_name", false}, row.controller);
    field({"force_?_n", "N", "force answered for [k, k+1)", "answer"}, row.f_Q_W);
    field({"compute_us", "µs", "wall time it took; 0 where held", "answer", false}, row.compute_us);
    field({"fault", "", "error code, or `held`, `fail_safe`", "kind"}, row.fault);
  }
};

/// The reference that the answer to state k follows.
struct ReferenceRow {
  static constexpr const char* kTopic = "sls/reference";
  static constexpr const char* kFile = "reference.csv";

  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  double sim_time_s = 0;
  std::string stage_name;
  Reference reference;  ///< without its stage's name

  template <class Row, class Visitor>
  static void visit(Row& row, Visitor& field) {
    auto& wire = row.reference;
    field({"vehicle_id", "", "vehicle", "vehicle_id"}, row.vehicle_id);
    field({"step", "", "k", "step"}, row.step);
    field({"sim_time_s", "s", "k × period", "step"}, row.sim_time_s);
    field({"stage", "", "index into the mission", "answer.reference"}, wire.stage_index());
    field({"stage_name", "", "its name", "answer.reference"}, row.stage_name);
    field({"ref_?_m", "m", "desired position of the load", "answer.reference"}, wire.position_m());
    field({"ref_v?_m_s", "m/s", "1st derivative", "answer.reference"}, wire.velocity_m_s());
    field({"ref_a?_m_s2", "m/s²", "2nd derivative", "answer.reference"}, wire.acceleration_m_s2());
    field({"ref_j?_m_s3", "m/s³", "3rd derivative", "answer.reference"}, wire.jerk_m_s3());
    field({"ref_s?_m_s4", "m/s⁴", "4th derivative", "answer.reference"}, wire.snap_m_s4());
  }
};

/// The three joined, in the order of the published flight logs.
struct FlightRow {
  static constexpr const char* kFile = "flight.csv";

  const StateRow& state;
  const CommandRow& command;
  const ReferenceRow& reference;
  bool is_of_fleet = false;  ///< true adds the column vehicle_id

  template <class Visitor>
  static void visit(const FlightRow& row, Visitor& field) {
    const PlantState& plant = row.state.plant;
    const model::CommandedAttitude attitude =
        model::calc_commanded_attitude(bus::to_vector(row.command.f_Q_W));
    const Eigen::Vector3d p_QL_W = bus::to_vector(plant.p_WL_m()) - bus::to_vector(plant.p_WQ_m());
    field({"sim_time_s", "s", "k × period", "state.csv"}, row.state.sim_time_s);
    field({"ref_?_m", "m", "desired position of the load", "reference.csv"},
          row.reference.reference.position_m());
    field({"quad_?_m", "m", "position of the quadrotor", "state.csv"}, plant.p_WQ_m());
    field({"roll_rad", "rad", "attitude that realises the force", "force"}, attitude.roll);
    field({"pitch_rad", "rad", "attitude that realises the force", "force"}, attitude.pitch);
    field({"yaw_rad", "rad", "attitude that realises the force", "force"}, attitude.yaw);
    field({"quad_v?_m_s", "m/s", "its velocity", "state.csv"}, plant.v_WQ_m_s());
    field({"rod_?", "", "unit vector of the rod", "state.csv"}, bus::to_array(p_QL_W.normalized()));
    field({"alpha_rad", "rad", "angle of the rod about x", "state.csv"}, plant.alpha_rad());
    field({"beta_rad", "rad", "angle of the rod about y", "state.csv"}, plant.beta_rad());
    field({"alpha_dot_rad_s", "rad/s", "its rate", "state.csv"}, plant.alpha_dot_rad_s());
    field({"beta_dot_rad_s", "rad/s", "its rate", "state.csv"}, plant.beta_dot_rad_s());
    field({"force_?_n", "N", "force answered", "command.csv"}, row.command.f_Q_W);
    if (row.is_of_fleet)
      field({"vehicle_id", "", "vehicle, of a fleet alone", "state.csv"}, row.state.vehicle_id);
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

/// The existing rows of one step of one vehicle.
struct StepRows {
  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;
  std::optional<StateRow> state;
  std::optional<StateRow> measured;  ///< only if it can differ from the truth
  std::optional<CommandRow> command;
  std::optional<ReferenceRow> reference;
  /// Step at which the stage of `reference` began. Only samples contain it, no file does.
  std::optional<std::uint64_t> stage_start_step;

  /// True if the three rows exist from which a row of flight.csv is made.
  bool is_complete() const { return state && command && reference; }
  /// True if no row is missing: a step without an answer may have no reference.
  bool is_whole() const { return state && command && (reference || command->is_unanswered()); }
};

/// The rows of an entry of any kind except AnswerKind::ANSWER_LATE. Rows that `rows` holds are
/// replaced and their memory is used again.
void fill_rows(StepRows& rows, const RecordEntry& entry, const Parameters& parameters);
StepRows make_rows(const RecordEntry& entry, const Parameters& parameters);
/// Adds the reference of `entry`, which is the answer to that step.
void add_reference(StepRows& rows, const RecordEntry& entry, const Parameters& parameters);

}  // namespace sls::record
