/// Timing of a run, in numbers and as the label of its end report. No clock here.
#pragma once

#include <cstdint>
#include <string>

#include "common/config/scenario.hpp"
#include "common/model/step_record.hpp"
#include "sls.h"

namespace sls::sim {

class TimingRecord {
 public:
  explicit TimingRecord(const config::Sync& sync) : sync_(sync) {}

  /// A period was flown with the force of an answer of this kind. The force answers a state that is
  /// `age` periods older than the period's own.
  void add(model::AnswerKind kind, std::uint64_t age);
  /// A state was published `delay_s` (wall time) after it was due. Real time only.
  void add_delay(double delay_s);
  /// The schedule was moved because the server was `lost_s` behind it. Real time only.
  void add_slip(double lost_s);
  /// Number of states and record entries that could not be published so far. Real time only.
  void set_overflow(std::uint64_t samples) { overflow_ = samples; }

  /// "exact": lockstep, every force an answer to its own state.
  /// "real-time, k of n late, worst age A ms, states at most B ms late": every state published, the
  ///   schedule kept, no fail-safe.
  /// "degraded: …": anything else, with its causes.
  std::string label() const;

  /// Writes the counts into `counters`.
  void fill(SyncCounters& counters) const;

 private:
  std::string describe_defects() const;

  const config::Sync sync_;
  std::uint64_t periods_ = 0;
  std::uint64_t held_ = 0;
  std::uint64_t fail_safe_ = 0;
  std::uint64_t worst_age_ = 0;  // of a held force, in periods
  double worst_delay_s_ = 0.0;
  std::uint64_t slips_ = 0;
  double lost_s_ = 0.0;
  std::uint64_t overflow_ = 0;
};

}  // namespace sls::sim
