/// The events of a recorded flight, for the marks of the slider.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "recorder/recording_reader.hpp"
#include "recorder/rows.hpp"
#include "tools/view/replay/recorded_parameters.hpp"

namespace sls::view {

struct RecordedEvent {
  std::uint64_t step = 0;
  double sim_time_s = 0;
  std::string text;
};

/// Most events of each kind; a slider has no room for more.
inline constexpr std::size_t kMostMarks = 500;

/// Changes of phase and reason in status.csv and the other events of flight.txt, by step. An
/// interrupted recording may have neither file. @throws record::DamagedError
std::vector<RecordedEvent> read_events(const record::OpenedRecording& flight, double period_s);

/// An interval of time with a fault, or without a good answer.
struct FaultInterval {
  double from_s = 0, to_s = 0;
  std::string kind;  ///< kind of the scenario's fault, or held, fail_safe, or an error code
  std::string on;    ///< state, command; empty if it is no fault of the scenario
  std::uint32_t vehicle_id = 0;
};

/// Faults of the scenario that begin before `end_s`; their intervals end there at the latest.
std::vector<FaultInterval> list_faults(const config::Scenario& scenario, double end_s);

struct StageStart {
  std::uint32_t vehicle_id = 0;
  double sim_time_s = 0;
  std::string name;
};

/// Finds stages, and steps without a good answer, in rows that are added one after another.
class RowEvents {
 public:
  explicit RowEvents(double period_s) : period_s_(period_s) {}

  /// Rows of each vehicle must come in step order.
  void add(const record::StepRows& rows);
  /// Ends the open fault intervals.
  void finish();

  const std::vector<StageStart>& stages() const { return stages_; }
  const std::vector<FaultInterval>& faults() const { return faults_; }

 private:
  struct Vehicle {
    std::optional<std::uint32_t> stage;
    std::string fault;
    std::uint64_t fault_from = 0, last_step = 0;
  };
  void end_fault(std::uint32_t vehicle_id, Vehicle& vehicle, std::uint64_t step);

  const double period_s_;
  std::map<std::uint32_t, Vehicle> vehicles_;
  std::vector<StageStart> stages_;
  std::vector<FaultInterval> faults_;
};

}  // namespace sls::view
