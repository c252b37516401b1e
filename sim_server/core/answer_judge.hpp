#pragma once

#include "sim_server/core/pacing.hpp"
#include "sim_server/core/run_parts.hpp"

namespace sls::sim {

/// Judges the answers of samples, and tells those who need to know the verdicts.
class AnswerJudge {
 public:
  AnswerJudge(RunParts& run, Pacing& pacing) : run_(run), pacing_(pacing) {}

  /// The states of the step in work left at `now`: earlier answers to it answer nothing.
  void published(sync::Time now) { published_ = now; }

  /// Offers each answer to the gate of its vehicle. `is_published`: the step in work was published.
  void judge(CommandSample& sample, bool is_published);

 private:
  void note(Verdict verdict, Vehicle& vehicle, const OfferedAnswer& offered,
            const CommandSample& sample);

  RunParts& run_;
  Pacing& pacing_;
  sync::Time published_{};
};

}  // namespace sls::sim
