#include "sim_server/core/answers/answer_check.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

#include "common/config/vehicle_ids.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::sim {
namespace {

/// Fewer answers to earlier steps are no mistake: a client that was stopped for a while sends some.
constexpr std::uint64_t kFewOldAnswers = 3;

/// `unpublished`: the first step whose state had not been published.
std::string describe_early(std::uint64_t got, std::uint64_t unpublished) {
  return unpublished == 0
             ? fmt::format("expected none before a state is published, got {}", got)
             : fmt::format("expected at most {}, the last published, got {}", unpublished - 1, got);
}

template <class SeenByKind, class MakeText>
void see(SeenByKind& seen, const char* kind, MakeText make_text) {
  const auto known = seen.find(kind);
  if (known != seen.end())
    known->second.is_fresh = true;
  else
    seen[kind].text = make_text();
}

}  // namespace

// --- answers arrive ------------------------------------------------------------------------------

/// All participants beyond the first kMostSenders share an entry, which nobody reads.
AnswerCheck::Sender& AnswerCheck::find_sender(const bus::PeerId& peer) {
  const auto known = senders_.find(peer);
  if (known != senders_.end()) return known->second;
  return senders_[senders_.size() < kMostSenders ? peer : bus::PeerId{}];
}

void AnswerCheck::note_taken(const OfferedAnswer& offered, const bus::PeerId& peer,
                             Verdict verdict) {
  Sender& sender = find_sender(peer);
  sender.rejected = 0;
  ++(verdict == Verdict::kDuplicate ? sender.copies : sender.steps);
  if (sender.client_name != offered.client_name) sender.client_name = offered.client_name;
  if (verdict != Verdict::kAccepted) return;
  flown_.insert(offered.vehicle_id);
  if (!config::is_utf8(offered.answer.stage_name))
    see(sender.seen, "stage name", [&] {
      return fmt::format("reference.stage_name at step {}: expected UTF-8, got '{}'", offered.step,
                         config::to_printable(offered.answer.stage_name, 64));
    });
}

void AnswerCheck::note_empty(const bus::PeerId& peer, std::uint64_t step) {
  see(find_sender(peer).seen, "empty", [&] {
    return fmt::format("vehicles at step {}: expected at least one answer, got none", step);
  });
}

void AnswerCheck::note_rejected(const OfferedAnswer& offered, const bus::PeerId& peer,
                                Verdict verdict, std::uint64_t step) {
  Sender& sender = find_sender(peer);
  if (verdict == Verdict::kEarly || (offered.run_id == run_id_ && offered.step > step))
    see(sender.seen, "early", [&] {
      return "step: " + describe_early(offered.step, verdict == Verdict::kEarly ? step : step + 1);
    });
  if (verdict == Verdict::kContradiction)
    see(sender.seen, "two", [&] {
      return fmt::format("step {}: expected one answer, got two that differ", offered.step);
    });
  const bool is_first = sender.rejected++ == 0,
             is_old = verdict == Verdict::kWrongStep && offered.step < step;
  if (is_first) sender.rejected_since.reset();
  sender.is_old = is_old && (is_first || sender.is_old);
  sender.defect = describe_defect(offered, verdict, step);
}

std::string AnswerCheck::describe_defect(const OfferedAnswer& offered, Verdict verdict,
                                         std::uint64_t step) const {
  switch (verdict) {
    case Verdict::kOtherRun:
      return fmt::format("run_id: expected {}, got {}", to_words(run_id_),
                         to_words(offered.run_id));
    case Verdict::kUnknownVehicle:
      return fmt::format("vehicle_id: expected {}, got {}", config::to_vehicle_ranges(vehicle_ids_),
                         offered.vehicle_id);
    case Verdict::kEarly:
      return "step: " + describe_early(offered.step, step);
    case Verdict::kWrongStep:
      return fmt::format("step: expected {}, got {}", step, offered.step);
    default:
      return to_string(verdict);
  }
}

std::string AnswerCheck::describe_rejections(const bus::PeerId& peer) const {
  const auto sender = senders_.find(peer);
  if (sender == senders_.end() || sender->second.rejected == 0) return "";
  return fmt::format(" ({} of its answers rejected, none taken: {})", sender->second.rejected,
                     sender->second.defect);
}

// --- the server looks around ---------------------------------------------------------------------

void AnswerCheck::look(const Neighbourhood& neighbourhood, Findings& findings) {
  for (const auto& [peer, ahead_s] : neighbourhood.stamps_ahead_s) {
    const sync::Member* member = neighbourhood.find(peer);
    if (member && neighbourhood.other_runs.count(member->announcement.run_id()) > 0) continue;
    see(find_sender(peer).seen, "stamp", [seconds = ahead_s] {
      return fmt::format(
          "source timestamp: expected none in the future, got {:.1f} s ahead of our clock",
          seconds);
    });
  }
  for (auto it = senders_.begin(); it != senders_.end();) {
    auto& [peer, sender] = *it;
    const sync::Member* member = neighbourhood.find(peer);
    const auto writer = neighbourhood.command_writers.find(peer);
    if (!member && writer == neighbourhood.command_writers.end()) {
      it = senders_.erase(it);
      continue;
    }
    ++it;
    for (auto seen = sender.seen.begin(); seen != sender.seen.end();) {
      if (std::exchange(seen->second.is_fresh, false)) seen->second.last = neighbourhood.now;
      const bool is_over = neighbourhood.now - seen->second.last > kMemory;
      if (!is_over)
        findings.add(peer, seen->first,
                     (member ? describe_participant(*member) : writer->second) + ": sls/command " +
                         seen->second.text);
      seen = is_over ? sender.seen.erase(seen) : std::next(seen);
    }
    if (member) {
      if (!neighbourhood.is_flying) sender.rejected_since = neighbourhood.now;
      look_at(sender, *member, neighbourhood.now, findings);
    } else {  // that is reported; it may announce itself under any name
      Sender unannounced;
      unannounced.seen.swap(sender.seen);
      sender = unannounced;
    }
  }
}

void AnswerCheck::look_at(Sender& sender, const sync::Member& member, sync::Time now,
                          Findings& findings) {
  const std::uint64_t steps = std::exchange(sender.steps, 0),
                      copies = std::exchange(sender.copies, 0);
  const std::string announced = member.announcement.name().to_string();
  if (sender.client_name && *sender.client_name != announced)
    findings.add(member.peer, "client_name",
                 fmt::format("{}: sls/command client_name: expected '{}', as announced, got '{}'",
                             describe_participant(member), config::to_printable(announced),
                             config::to_printable(*sender.client_name)));
  if (member.announcement.done() && steps > 0 && findings.lasts(member.peer, "done"))
    findings.add(member, "done", "done", "false, as it still answers", "true");
  const std::uint64_t each = copies / std::max<std::uint64_t>(steps, 1);
  if (each > kMostCopies && findings.lasts(member.peer, "copies"))
    findings.add(member.peer, "copies",
                 fmt::format("{}: sls/command: expected one answer to each state, got over {} "
                             "copies of each",
                             describe_participant(member), kMostCopies));
  if (sender.rejected == 0 || member.is_presumed_dead(now)) return;
  if (!sender.rejected_since) sender.rejected_since = now;
  const bool is_few = sender.is_old && sender.rejected < kFewOldAnswers;
  if (!findings.has_any(member.peer) && !is_few &&
      now - *sender.rejected_since >= findings.patience())
    findings.add(member.peer, "rejected",
                 fmt::format("{}: sls/command: {} answers rejected, none taken: {}",
                             describe_participant(member), sender.rejected, sender.defect));
}

}  // namespace sls::sim
