#include "python/bindings/flight_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <type_traits>
#include <utility>
#include <variant>

#include "closed_loop/flight_certificate.hpp"
#include "common/app/run_error.hpp"
#include "common/app/version.hpp"
#include "recorder/columns.hpp"
#include "recorder/rows.hpp"
#include "sim_server/messages.hpp"

namespace sls::python {
namespace {

using model::StepRecord;
using Kind = ColumnPlace::Kind;

/// Writes a row from left to right.
class Writer {
 public:
  explicit Writer(double* cell) : cell_(cell) {}
  void add(double value) { *cell_++ = value; }
  void add(std::uint64_t value) { std::memcpy(cell_++, &value, sizeof value); }
  /// Adds all members of an object that consists of doubles only.
  template <class Doubles>
  void add_all(const Doubles& doubles) {
    static_assert(std::is_standard_layout_v<Doubles> && sizeof(Doubles) % sizeof(double) == 0);
    std::memcpy(cell_, &doubles, sizeof doubles);
    cell_ += sizeof doubles / sizeof(double);
  }
  void add_numbers(const model::Numbers& numbers) {
    cell_ = std::copy_n(numbers.data(), numbers.size(), cell_);
  }

 private:
  double* cell_;
};

/// Reads a row, in the order in which Writer wrote it.
class Reader {
 public:
  explicit Reader(const double* cell) : cell_(cell) {}
  void take(double& value) { value = *cell_++; }
  std::uint64_t take_integer() {
    std::uint64_t value = 0;
    std::memcpy(&value, cell_++, sizeof value);
    return value;
  }
  template <class Doubles>
  void take_all(Doubles& doubles) {
    std::memcpy(static_cast<void*>(&doubles), cell_, sizeof doubles);
    cell_ += sizeof doubles / sizeof(double);
  }
  void take_numbers(model::Numbers& numbers) {
    std::copy_n(cell_, numbers.size(), numbers.data());
    cell_ += numbers.size();
  }

 private:
  const double* cell_;
};

// add_all copies these types as blocks: their members have the order of the columns in state.csv
// and reference.csv, without gaps.
static_assert(sizeof(model::SlungLoadState) == 16 * sizeof(double));
static_assert(sizeof(model::Reference) == 15 * sizeof(double));

const model::SlungLoadState& bodies(const model::Measurement& state) { return state; }
model::SlungLoadState& bodies(model::Measurement& state) { return state; }

void write_attitude(Writer& row, const model::Attitude& attitude) {
  row.add(attitude.q_WB.w());
  row.add(attitude.q_WB.x());
  row.add(attitude.q_WB.y());
  row.add(attitude.q_WB.z());
  row.add_all(attitude.w_WB_B);
}

void read_attitude(Reader& row, model::Attitude& attitude) {
  row.take(attitude.q_WB.w());
  row.take(attitude.q_WB.x());
  row.take(attitude.q_WB.y());
  row.take(attitude.q_WB.z());
  row.take_all(attitude.w_WB_B);
}

/// Number of steps if each stage of the mission has its shortest duration; at most 1,000,000.
std::size_t estimate_steps(const config::Scenario& scenario) {
  std::int64_t duration_ns = 0;
  for (const config::Stage& stage : scenario.mission)
    duration_ns += config::find_least_duration_ns(stage.leave);
  // The bound avoids a huge reservation for a very long mission: rows grow when they are needed.
  return static_cast<std::size_t>(
      std::min<std::int64_t>(duration_ns / scenario.sync.period_ns + 1, 1'000'000));
}

/// Tells the loop when to call `rest`, about 50 times a second. It reads the clock only once in 64
/// steps of a vehicle.
class RestTimer {
 public:
  bool is_due(std::size_t vehicles) {
    steps_ += vehicles;
    if (steps_ < 64) return false;
    steps_ = 0;
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(20)) return false;
    last_ = now;
    return true;
  }

 private:
  std::size_t steps_ = 0;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace

// --- flying --------------------------------------------------------------------------------------

FlightTable::FlightTable(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
                         const closed_loop::FlightOptions& options,
                         const std::function<void()>& rest)
    : scenario_(scenario), ids_(ids), controller_name_(options.controller_name) {
  closed_loop::Flight flight(scenario, ids, options);
  parameters_ = sim::make_parameters_message(sim::make_run_id(), ids, scenario, flight.plant(),
                                             app::version());
  RestTimer timer;
  while (flight.fly_step()) {
    if (columns_.empty()) list_columns(flight);
    for (std::size_t i = 0; i < ids.size(); ++i) keep(flight.steps()[i], i);
    keep_remarks(flight);
    if (timer.is_due(ids.size())) rest();
  }
  if (flight.is_law_broken()) throw app::RunError(flight.failure());
  keep_remarks(flight);
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (flight.steps()[i].kind == model::AnswerKind::kRefused) refused_ = i;
  failure_ = flight.failure();
}

void FlightTable::list_columns(const closed_loop::Flight& flight) {
  has_attitude_ = parameters_.has_attitude();
  for (const StepRecord& step : flight.steps()) differs_.push_back(step.measured.has_value());
  has_measured_ = std::count(differs_.begin(), differs_.end(), true) > 0;
  signals_ = parameters_.signals().size();
  std::size_t index = 0;
  const auto add = [&](const char* table, const std::string& name, Kind kind = Kind::kDouble) {
    columns_.push_back({table, name, index++, kind});
  };
  const auto share = [&](const char* table, const std::string& name) {
    const auto found = std::find_if(columns_.begin(), columns_.end(), [&](const ColumnPlace& it) {
      return it.table == "state" && it.name == name;
    });
    columns_.push_back({table, name, found->index, found->kind});
  };
  const auto is_shared = [](const std::string& name) {
    return name == "vehicle_id" || name == "step" || name == "sim_time_s";
  };

  record::StepRows rows;
  rows.has_attitude = has_attitude_;
  std::vector<std::string> names;
  for (const auto& [column, of_column] : record::list_columns<record::StateRow>(rows))
    names.insert(names.end(), of_column.begin(), of_column.end());
  for (const SignalDescription& signal : parameters_.signals())
    names.push_back(signal.name().to_string());
  for (const std::string& name : names)
    add("state", name, name == "vehicle_id" || name == "step" ? Kind::kInteger : Kind::kDouble);
  for (const std::string& name : names) {
    if (!has_measured_) break;
    if (is_shared(name) || name.rfind("force_", 0) == 0)
      share("measured", name);
    else
      add("measured", name);
  }

  for (const auto& [column, of_column] : record::list_columns<record::CommandRow>())
    for (const std::string& name : of_column)
      if (is_shared(name))
        share("command", name);
      else if (name == "fault")
        add("command", name, Kind::kErrorCode);
      else if (column.is_certified)  // neither the controller's name nor the compute time
        add("command", name);
  for (const auto& [column, of_column] : record::list_columns<record::ReferenceRow>())
    for (const std::string& name : of_column)
      if (is_shared(name))
        share("reference", name);
      else if (name == "stage_name")
        columns_.push_back({"reference", name, index - 1, Kind::kStageName});  // cell of `stage`
      else
        add("reference", name, name == "stage" ? Kind::kInteger : Kind::kDouble);
  const std::size_t steps = estimate_steps(scenario_);
  index += 3;  // three cells without a column, for the recorder: the end of `keep`
  for (std::size_t i = 0; i < ids_.size(); ++i) rows_.emplace_back(index, steps);
}

void FlightTable::keep(const StepRecord& flown, std::size_t index) {
  Writer row(rows_[index].add_row());
  const auto write_rest = [&](const model::Measurement& state) {
    if (has_attitude_) write_attitude(row, state.attitude);
    row.add_numbers(state.signals);
  };
  row.add(std::uint64_t{ids_[index]});
  row.add(flown.step);
  row.add(static_cast<double>(static_cast<std::int64_t>(flown.step) * scenario_.sync.period_ns) /
          1e9);
  row.add_all(bodies(flown.truth));
  row.add_all(flown.f_Q_W);
  write_rest(flown.truth);
  if (has_measured_) {
    row.add_all(bodies(flown.seen()));
    write_rest(flown.seen());
  }
  const model::Answer& answer = flown.answer;
  row.add_all(answer.f_Q_W);
  row.add(static_cast<std::uint64_t>(answer.error_code));
  row.add(std::uint64_t{answer.stage});
  row.add_all(answer.reference);
  row.add(std::uint64_t{answer.memory.stage});
  row.add(answer.memory.stage_start_step);
  row.add(static_cast<std::uint64_t>(answer.mission));
}

void FlightTable::keep_remarks(closed_loop::Flight& flight) {
  std::vector<std::string> texts = flight.take_remarks();
  if (!texts.empty()) remarks_.push_back({rows_.front().rows(), std::move(texts)});
}

// --- recording and certificate -------------------------------------------------------------------

StepRecord FlightTable::make_step(std::size_t index, std::size_t number) const {
  Reader row(rows_[index].row(number));
  StepRecord flown;
  const bool is_refused = number == last_step() && refused_ == index;
  flown.kind = is_refused ? model::AnswerKind::kRefused : model::AnswerKind::kAccepted;
  flown.client_name = controller_name_;
  flown.vehicle_id = ids_[index];
  const auto read_rest = [&](model::Measurement& state) {
    if (has_attitude_) read_attitude(row, state.attitude);
    state.signals.resize(static_cast<Eigen::Index>(signals_));
    row.take_numbers(state.signals);
  };
  row.take_integer();  // the vehicle's id
  flown.step = flown.answered_step = row.take_integer();
  double time_s = 0.0;
  row.take(time_s);
  row.take_all(bodies(flown.truth));
  row.take_all(flown.f_Q_W);
  read_rest(flown.truth);
  if (has_measured_) {
    model::Measurement& measured = flown.measured.emplace();
    row.take_all(bodies(measured));
    read_rest(measured);
    if (!differs_[index]) flown.measured.reset();
  }
  model::Answer& answer = flown.answer;
  row.take_all(answer.f_Q_W);
  answer.error_code = static_cast<model::ErrorCode>(row.take_integer());
  answer.stage = static_cast<std::uint32_t>(row.take_integer());
  if (answer.stage < scenario_.mission.size())
    answer.stage_name = scenario_.mission[answer.stage].name;
  row.take_all(answer.reference);
  answer.memory.stage = static_cast<std::uint32_t>(row.take_integer());
  answer.memory.stage_start_step = row.take_integer();
  answer.mission = static_cast<model::MissionPhase>(row.take_integer());
  return flown;
}

const std::string& FlightTable::calc_certificate() const {
  std::call_once(is_certified_, [this] {
    closed_loop::FlightCertificate certificate(record::make_row_format(parameters_));
    for (std::size_t i = 0; i < ids_.size(); ++i)
      for (std::size_t row = 0; row < rows_[i].rows(); ++row) certificate.add(make_step(i, row));
    certificate_ = certificate.finish();
  });
  return certificate_;
}

bool FlightTable::save(const std::filesystem::path& folder, bool force) const {
  closed_loop::FlightRecorder recorder(folder, force, parameters_, scenario_.sync,
                                       controller_name_);
  recorder.note_law_library(scenario_);
  auto remarks = remarks_.begin();
  std::vector<StepRecord> steps(ids_.size());
  for (std::size_t row = 0; row < rows_.front().rows(); ++row) {
    for (std::size_t i = 0; i < ids_.size(); ++i) steps[i] = make_step(i, row);
    recorder.add(steps);
    for (; remarks != remarks_.end() && remarks->rows <= row + 1; ++remarks)
      recorder.announce(remarks->texts);
  }
  for (; remarks != remarks_.end(); ++remarks) recorder.announce(remarks->texts);
  return recorder.finish(failure_);
}

}  // namespace sls::python
