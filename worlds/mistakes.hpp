/// Mistakes of clients that do not keep the contract, one entry for each.
#pragma once

#include <cstdint>
#include <vector>

#include "sls.h"

namespace sls::worlds {

/// A mistake in the answers of a client that is ready.
struct AnswerMistake {
  void (*make)(ControlCommand& answer, std::uint64_t step);  ///< called for each copy
  std::uint64_t steps = 1'000'000;  ///< with the mistake, because the flight must end
  int copies = 1;                   ///< of each answer; 0: samples without answers
};
const std::vector<AnswerMistake>& list_answer_mistakes();

/// A mistake in an otherwise correct announcement. A client that makes it never flies.
struct AnnouncementMistake {
  void (*make)(Participant& announcement);
  bool is_wild = false;        ///< others wait for the client that makes it
  bool reads_states = true;    ///< false: has no reader of sls/state
  bool writes_answers = true;  ///< false: has no writer of sls/command
};
const std::vector<AnnouncementMistake>& list_announcement_mistakes();

}  // namespace sls::worlds
