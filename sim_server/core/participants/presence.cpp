#include "sim_server/core/participants/presence.hpp"

#include <algorithm>
#include <utility>

namespace sls::sim {

void Presence::look(std::vector<sync::Member>& controllers,
                    const std::map<bus::PeerId, Answering>& answering, Clock::time_point now) {
  const Clock::duration elapsed = now - std::exchange(looked_, now);
  std::map<bus::PeerId, Seen> present;
  for (auto& entry : controllers) {
    const auto known = seen_.find(entry.peer);
    const auto flies = answering.find(entry.peer);
    const Answering answers = flies == answering.end() ? Answering() : flies->second;
    Seen seen = known == seen_.end() ? Seen() : known->second;
    const bool is_heard =
        known == seen_.end() || entry.heard != seen.heard || answers.answers != seen.answers;
    // A client may announce itself once only. Then only a state that awaits it
    // asks for a sign of life.
    const bool owes_sign = entry.is_repeated || (answers.is_asked && seen.was_asked);
    if (is_heard)
      seen.silence = Clock::duration(0);
    else if (owes_sign)
      seen.silence += elapsed;
    seen.heard = entry.heard;
    seen.answers = answers.answers;
    seen.was_asked = answers.is_asked;
    entry.is_gone = seen.silence >= sync::kPresumedDeadAfter;
    present.emplace(entry.peer, seen);
  }
  seen_ = std::move(present);
}

}  // namespace sls::sim
