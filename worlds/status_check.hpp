/// What a server says of its run in sls/status, judged by what it did.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/step_record.hpp"
#include "sls.h"
#include "worlds/host.hpp"

namespace sls::worlds {

class Program;

class StatusCheck {
 public:
  /// Of a run of `server` with so many vehicles. `find`: called with each false statement.
  StatusCheck(const config::Sync& sync, std::size_t vehicles, const Program& server,
              std::function<void(std::string)> find)
      : sync_(sync), vehicles_(vehicles), server_(server), find_(std::move(find)) {}

  void on_published(std::uint64_t step) { step_ = step; }
  void on_resent() { ++resent_; }
  void on_recorded(const std::vector<model::StepRecord>& records);
  void on_status(const SimStatus& status);
  /// The server was stopped or continued, or became slower or faster.
  void on_disturbed() { is_disturbed_ = true; }

 private:
  /// Steps of vehicles.
  struct Counts {
    std::uint64_t held = 0, fail_safe = 0;
    std::uint64_t worst_age = 0;  // of a held answer, steps
  };

  void check_counter(const char* name, std::uint64_t said, std::uint64_t happened,
                     std::uint64_t most);
  std::string describe_timing(const Counts& counts, std::uint64_t steps) const;

  const config::Sync& sync_;
  const std::size_t vehicles_;
  const Program& server_;
  const std::function<void(std::string)> find_;
  std::uint64_t step_ = 0;  // the last one published
  Counts counts_, before_;  // before_: without the last step
  std::uint64_t resent_ = 0, changes_ = 0;
  std::uint64_t accepted_ = 0, answered_ = 0, flown_ = 0;  // steps of vehicles
  std::map<std::uint32_t, std::string> flyers_;            // the last ones, by vehicle
  std::optional<SimStatus> last_;
  Instant last_time_{0};        // awake time of the server
  bool is_disturbed_ = false;   // since the last status
  bool was_disturbed_ = false;  // at any time
  bool is_over_ = false;
};

}  // namespace sls::worlds
