/// flight.txt, a summary for people: stages, tracking errors and events, collected during the
/// recording.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "common/model/measures.hpp"
#include "recorder/manifest.hpp"
#include "recorder/rows.hpp"

namespace sls::record {

class FlightLog {
 public:
  FlightLog(const config::Scenario& scenario, const Parameters& parameters);

  /// Sets starts of stages, for rows that do not contain them.
  void set_stage_starts(const std::vector<StageStart>& starts) { known_starts_ = starts; }
  /// The starts of stages that began at another step than the first one added.
  std::vector<StageStart> list_stage_starts() const;

  /// Adds a step. Ignores one that is not complete, because it gives no error.
  void add(const StepRows& rows);
  /// `is_repeated`: an earlier segment has its event.
  void add(const SimStatus& status, bool is_repeated = false);
  /// Adds a line of the recorder, for example a list of missing samples.
  void add_event(const std::string& text);

  void write(std::ostream& out) const;

 private:
  struct Stage {
    std::string name;
    std::uint64_t start_step = 0;  // of the stage; laps count from here
    std::uint64_t first_step = 0;  // the first one with rows
    std::uint64_t last_step = 0;
    model::ErrorStatistics all;                // of the load position error
    std::vector<model::ErrorStatistics> laps;  // of a figure eight, the first ones
  };

  /// Of one vehicle, in the order of their beginning.
  struct Stages {
    std::vector<std::pair<std::uint32_t, Stage>> listed;  // by index in the mission
    std::uint64_t left_out = 0;                           // later ones
    std::optional<std::uint32_t> current;
  };

  /// Null if the stage is left out.
  Stage* find_or_begin_stage(const StepRows& rows);
  void write_counters(std::ostream& out) const;
  std::uint64_t find_start(std::uint32_t vehicle_id, std::uint32_t index,
                           std::uint64_t first_step) const;
  std::int64_t calc_flown_ns(const Stage& stage, std::uint64_t step) const;
  std::size_t calc_lap(const Stage& stage, std::size_t index, std::uint64_t step) const;
  bool is_whole_lap(const Stage& stage, std::size_t index, std::size_t lap) const;
  double to_time(std::uint64_t step) const;

  const config::Scenario scenario_;
  const Parameters parameters_;
  std::map<std::uint32_t, Stages> stages_;  // by vehicle
  std::vector<StageStart> known_starts_;
  std::vector<std::string> first_events_;
  std::deque<std::string> last_events_;  // after those left out
  std::uint64_t left_out_events_ = 0;
  SimStatus last_status_;
};

}  // namespace sls::record
