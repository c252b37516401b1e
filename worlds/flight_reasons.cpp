#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <string_view>

#include "worlds/flight_watch.hpp"
#include "worlds/server_program.hpp"

/// Judges the reason of a failed run by what has arrived at its server. A participant that the
/// reason names as missing must be missing, and for as long as the scenario says.
namespace sls::worlds {
namespace {

using namespace std::chrono_literals;

/// A participant counts as there if it has been ready for this long, and was heard this recently.
constexpr Instant kReadySince = 1s, kHeardSince = 1500ms;

constexpr std::size_t kNowhere = std::string::npos;

bool holds(const std::string& text, const char* part) { return text.find(part) != kNowhere; }

/// What is behind the first `part` of the text; empty if it is not there.
std::string find_behind(const std::string& text, std::string_view part) {
  const std::size_t at = text.find(part);
  return at == kNowhere ? "" : text.substr(at + part.size());
}

/// The names in "controller 'NAME'" that are followed by `more`.
std::vector<std::string> list_names(const std::string& text, std::string_view more) {
  static constexpr std::string_view kWord = "controller '";
  std::vector<std::string> names;
  for (std::size_t at = 0; (at = text.find(kWord, at)) != kNowhere;) {
    at += kWord.size();
    const std::size_t end = text.find('\'', at);
    if (end != kNowhere && text.compare(end + 1, more.size(), more) == 0)
      names.push_back(text.substr(at, end - at));
  }
  return names;
}

}  // namespace

bool FlightWatch::on_failed(const std::string& reason, Instant now) {
  const std::vector<std::string> refused = list_names(reason, " answered step");
  const std::string waited = find_behind(reason, "waited ");
  if (holds(reason, "interrupted by SIG")) {
    if (!server_.was_interrupted()) find_("reason: " + reason + ", but nobody sent a signal");
  } else if (holds(reason, "expected no other server")) {
    // on_yielded judges it.
  } else if (reason.rfind("stopped by ", 0) == 0) {
    if (!stop_requested_) find_("reason: " + reason + ", but nobody has asked for it");
  } else if (reason == "write refused") {
    if (!static_cast<const ServerProgram&>(server_).has_been_refused())
      find_("reason: " + reason + ", but none was");
  } else if (reason.rfind("not ready within ", 0) == 0) {
    check_start(reason, now);
  } else if (!waited.empty()) {
    check_wait(reason, waited, !refused.empty(), now);
  } else if (holds(reason, "the mission was finished, but ")) {
    check_absence(reason, reason, now);
  } else if (refused.empty()) {
    return false;
  }
  for (const std::string& name : refused) {
    const auto clients = find_clients(name);
    if (std::none_of(clients.begin(), clients.end(),
                     [](const Client* client) { return client->has_erred; }))
      find_("reason: " + reason + ", but its answer has no mistake");
  }
  return true;
}

/// `waited`: "1 s for controller 'a' on box; a problem". `is_refused`: an answer was refused.
void FlightWatch::check_wait(const std::string& reason, const std::string& waited, bool is_refused,
                             Instant now) {
  std::string named = find_behind(waited, " s for ");
  named.resize(std::min(named.size(), named.find("; ")));
  const double deadline_s = std::stod(waited);
  if (named.rfind("recorder", 0) == 0) {
    if (is_lockstep()) check_early(reason, published_awake_, deadline_s);
    if (!is_unclear() && holds(named, " expected, ") &&
        count_recorders(now) >= sync_.wait_for.recorders)
      find_("reason: " + reason + ", but they are there");
    return;
  }
  Instant since = published_awake_;
  for (const auto& [vehicle, lacking] : lacking_) since = std::min(since, lacking.published);
  if (!is_refused) check_early(reason, since, deadline_s);
  check_absence(reason, named, now);
}

/// Those that a line about the open step names are missing.
void FlightWatch::on_line(const std::string& line, Instant now) {
  const bool is_about_absence =
      holds(line, ": waiting for: controller") || holds(line, ": no answer from controller");
  if (is_about_absence && line.rfind(fmt::format("step {}: ", step_), 0) == 0)
    check_absence(line, line.substr(0, line.find("; ")), now);
}

/// The expected ones were missing, and for as long as the scenario says.
void FlightWatch::check_start(const std::string& reason, Instant now) {
  check_early(reason, began_, sync_.wait_for.timeout_s);
  if (is_unclear() || count_recorders(now) < sync_.wait_for.recorders) return;
  for (const std::uint32_t vehicle : vehicle_ids_) {
    const auto there = std::count_if(clients_.begin(), clients_.end(), [&](const auto& item) {
      const auto& ids = item.second.vehicle_ids;
      return std::find(ids.begin(), ids.end(), vehicle) != ids.end() && is_there(item.second, now);
    });
    if (there < sync_.wait_for.controllers) return;
  }
  find_("reason: " + reason + ", but all are there");
}

/// Those that are named are missing.
void FlightWatch::check_absence(const std::string& reason, const std::string& named, Instant now) {
  if (is_unclear()) return;
  if (holds(named, "(none is ready)") &&
      std::any_of(clients_.begin(), clients_.end(), [&](const auto& item) {
        return is_there(item.second, now) && item.second.vehicle_ids.size() == vehicle_ids_.size();
      }))
    find_("reason: " + reason + ", but a controller is ready");
  const auto find_one = [&](const std::string& name) {
    const auto clients = find_clients(name);
    return clients.size() == 1 && is_there(*clients.front(), now) ? clients.front() : nullptr;
  };
  for (const std::string& name : list_names(named, " (gone)"))
    if (find_one(name)) find_(fmt::format("reason: {}, but '{}' is there", reason, name));
  for (const std::string& name : list_names(named, " on ")) {
    const Client* client = find_one(name);
    if (client && std::all_of(client->vehicle_ids.begin(), client->vehicle_ids.end(),
                              [&](std::uint32_t vehicle) {
                                return client->has_answered(vehicle, step_) &&
                                       client->answers.at(vehicle) < now - kSlack;
                              }))
      find_(fmt::format("reason: {}, but '{}' has answered", reason, name));
  }
}

void FlightWatch::check_early(const std::string& reason, Instant since, double deadline_s) {
  const Instant waited = server_.awake() - since;
  if (waited < sync::to_duration(deadline_s) - kSlack)
    find_(
        fmt::format("reason: {}, but only {:.3f} s have passed", reason, sync::to_seconds(waited)));
}

/// It has been ready, and heard without a long silence, for a while.
bool FlightWatch::is_present(const Heard& participant, Instant now) const {
  return !participant.process->has_ended() &&
         std::max(participant.ready, participant.back) + kReadySince < now &&
         server_.awake() - participant.heard_awake < kHeardSince;
}

bool FlightWatch::is_there(const Client& client, Instant now) const {
  const bus::PeerId& peer = std::get<bus::PeerId>(client.order);
  return client.is_ready && is_present(client, now) &&
         server_.peer().matched_readers(TopicId::kState).count(peer) > 0 &&
         server_.peer().matched_writers(TopicId::kCommand).count(peer) > 0;
}

int FlightWatch::count_recorders(Instant now) const {
  return static_cast<int>(
      std::count_if(recorders_.begin(), recorders_.end(), [&](const auto& item) {
        const Recorder& recorder = item.second;
        return recorder.ready > Instant(0) && is_present(recorder, now) &&
               server_.peer().matched_writers(TopicId::kParticipant).count(recorder.peer) > 0;
      }));
}

std::vector<const FlightWatch::Client*> FlightWatch::find_clients(
    const std::string& announced_name) const {
  std::vector<const Client*> found;
  for (const auto& [name, client] : clients_)
    if (std::get<std::string>(client.order) == announced_name) found.push_back(&client);
  return found;
}

}  // namespace sls::worlds
