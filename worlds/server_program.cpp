#include "worlds/server_program.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/bus/convert.hpp"
#include "sim_server/messages.hpp"

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kDatagram_bytes = 1400;
constexpr std::size_t kBatch_bytes = 60'000;

}  // namespace

ServerProgram::ServerProgram(Setting& setting, Host& host, std::string name,
                             std::vector<std::uint32_t> vehicle_ids)
    : Program(setting, host, Role::kServer, std::move(name)),
      vehicle_ids_(std::move(vehicle_ids)),
      states_(kDatagram_bytes) {}

void ServerProgram::start() {
  // The order of the endpoints is that of sim_server/endpoints.hpp.
  peer_.add_reader<Commands>([this](const Commands& sample,
                                    const Peer::Arrival& arrival) { on_commands(sample, arrival); },
                             is_realtime() ? Peer::kRealtimeLimits : ReaderLimits());
  peer_.add_writer<Parameters>();
  peer_.add_reader<Participant>([this](const Participant& sample, const Peer::Arrival& arrival) {
    note(sample, arrival);
    if (flight_)
      flight_->on_member(sample, arrival.sender, sender(arrival), setting_.timeline.now());
    if (core_ && core_->has_news(*this)) wake_soon();
  });
  read<Parameters>();
  read<SimStatus>();
  peer_.add_writer<States>();
  peer_.add_writer<RecordBatch>();
  peer_.add_writer<SimStatus>();
  peer_.add_writer<SimControlReply>();
  peer_.add_reader<SimControl>([this](const SimControl& request, const Peer::Arrival&) {
    setting_.properties.on_request(request);
    const bool is_ours =
        core_ && request.run_id() == core_->run_id() &&
        std::count(vehicle_ids_.begin(), vehicle_ids_.end(), request.vehicle_id()) > 0;
    if (is_ours) flight_->on_request(request.action());
    events_.push_back(request);
    wake_soon();
  });
  setting_.network.announce(peer_);
  begin_run({});
  wake_soon();
}

void ServerProgram::begin_run(sim::ServerCore::Start start) {
  const config::Scenario& scenario = setting_.flown->scenario;
  start.run_id = setting_.random.next() | 1u;
  auto fleet =
      std::make_unique<sim::Fleet>(scenario, vehicle_ids_, start.run_id, sim::one_after_another);
  events_.erase(std::remove_if(events_.begin(), events_.end(),
                               [](const Event& event) {
                                 return std::holds_alternative<sim::CommandSample>(event);
                               }),
                events_.end());
  batches_.emplace(kBatch_bytes, start.run_id);
  next_batch_ = lost_ = 0;
  states_.begin_run(start.run_id, scenario.sync.period_ns);
  const Parameters parameters =
      sim::make_parameters_message(start.run_id, vehicle_ids_, scenario, fleet->plant(), "world");
  certificate_.emplace(record::make_row_format(parameters));
  setting_.properties.on_run(*this, start.run_id, parameters, scenario);
  const FlightWatch* before = std::exchange(flight_, &setting_.properties.flight(start.run_id));
  if (before) flight_->requests().follow(before->requests());
  peer_.write(parameters);
  say(fmt::format("run {:016x}", start.run_id));
  sim::Outputs& outputs = *this;
  core_ = std::make_unique<sim::ServerCore>(scenario, start, std::move(fleet), outputs, now());
}

// --- the main thread -----------------------------------------------------------------------------

void ServerProgram::wake() {
  if (leaving_) return linger();
  write_waiting();
  if (core_->phase() != sim::ServerCore::Phase::kEnded)
    core_->on_wake(
        *this, [this] { deliver_events(); }, [this] { return now(); });
  if (core_->phase() == sim::ServerCore::Phase::kEnded) end_run();
  if (!process_.has_ended()) wake_at(leaving_ ? now() : core_->next_deadline());
}

void ServerProgram::deliver_events() {
  for (Event& event : std::exchange(events_, {})) {
    if (auto* sample = std::get_if<sim::CommandSample>(&event))
      core_->on_commands(*sample);
    else
      take_up(std::get<SimControl>(event));
  }
}

void ServerProgram::take_up(const SimControl& request) {
  const bool is_of_other =
      request.run_id() != core_->run_id() && is_known_elsewhere(request.run_id());
  flight_->requests().on_request(request, is_of_other);
  core_->on_request(request, *this, now());
}

void ServerProgram::end_run() {
  write_waiting();
  setting_.properties.on_run_end(core_->run_id(), core_->end() == sim::ServerCore::End::kFinished,
                                 certificate_->finish(), core_->error(), setting_.network);
  if (core_->end() == sim::ServerCore::End::kReset) {
    if (!is_refused_) return begin_run(core_->make_next_start());
    fail_refused();  // sls/parameters
    write_waiting();
  }
  if (core_->error().find("expected no other server") != std::string::npos)
    setting_.properties.on_yielded(*this, core_->run_id(), setting_.network);
  if (!core_->is_known()) return exit(1, core_->error());
  leaving_.emplace(core_->leave(now()));
}

/// As Server::linger.
void ServerProgram::linger() {
  sync::Membership& members = present_members();
  const bool is_acknowledged = peer_.is_acknowledged(TopicId::kRecord) &&
                               peer_.is_acknowledged(TopicId::kStatus) &&
                               peer_.is_acknowledged(TopicId::kControlReply);
  const bool is_over =
      leaving_->look({members.find(ParticipantRole::ROLE_RECORDER, core_->run_id()),
                      members.count_done(ParticipantRole::ROLE_RECORDER, core_->run_id()),
                      was_interrupted(), is_acknowledged},
                     now());
  for (const sync::Line& line : leaving_->take_lines()) say(line);
  if (!is_over) return wake_at(now() + 20ms);
  const std::string& error = core_->error().empty() ? leaving_->error() : core_->error();
  exit(error.empty() ? 0 : 1, error);
}

void ServerProgram::write_waiting() {
  while (!outbox_.empty()) {
    const Item item = std::move(outbox_.front());
    outbox_.pop_front();
    const bool is_sample =
        std::holds_alternative<SimStatus>(item) || std::holds_alternative<SimControlReply>(item);
    if (is_refused_ && is_sample) {
      fail_refused();
    } else if (const auto* status = std::get_if<SimStatus>(&item)) {
      setting_.properties.on_status(*status, setting_.network);
      if (setting_.trace.keeps_lines())
        say(fmt::format("status {}: {} step {} {} {}", status->sample_index(),
                        bus::to_string(status->phase()), status->step(), status->reason().c_str(),
                        status->problem().c_str()));
      peer_.write(*status);
    } else if (const auto* reply = std::get_if<SimControlReply>(&item)) {
      setting_.properties.on_replied(*this, reply->request_id(), setting_.network);
      flight_->requests().on_reply(*reply);
      peer_.write(*reply);
    } else if (const auto* line = std::get_if<sync::Line>(&item)) {
      say(*line);
    } else {
      write_records(true);
    }
  }
}

void ServerProgram::fail_refused() {
  has_been_refused_ = true;
  core_->on_failure("write refused", now());
}

void ServerProgram::block_records(bool is_blocked) {
  const bool goes_on = std::exchange(is_blocked_, is_blocked) && !is_blocked;
  if (goes_on && !process_.has_ended()) process_.run([this] { write_records(false); });
}

// --- the middleware's thread ---------------------------------------------------------------------

void ServerProgram::on_commands(const Commands& sample, const Peer::Arrival& arrival) {
  if (!core_ || leaving_) return;
  flight_->on_answers(sample, sender(arrival), setting_.timeline.now());
  sim::CommandSample received;
  received.sender = arrival.sender;
  received.arrived = {now(), process_.host().wall()};
  received.written = arrival.written;
  sim::fill(received, sample);
  // As CoreLoop::pass_on.
  if (!is_realtime() && events_.empty() && core_->takes_answers_at_once(*this)) {
    core_->on_commands(received);
    if (!outbox_.empty() || core_->phase() == sim::ServerCore::Phase::kEnded) wake_soon();
    return wake_at(core_->next_deadline());
  }
  if (events_.size() < sim::kMostWaitingCommands) events_.push_back(std::move(received));
  wake_soon();
}

// --- outputs -------------------------------------------------------------------------------------

sim::Moment ServerProgram::send_states(const sim::Fleet& fleet) {
  const sim::Moment moment{now(), process_.host().wall(), clock_.stopped()};
  setting_.properties.on_published(core_->run_id(), fleet.step(),
                                   setting_.flown->scenario.sync.wait_for);
  setting_.on_step(fleet.step());
  states_.make(
      fleet, [](std::size_t) { return true; },
      [this](const States& sample) { peer_.write(sample); });
  return moment;
}

void ServerProgram::resend_states(const sim::Fleet& fleet,
                                  const std::function<bool(std::size_t)>& is_wanted) {
  flight_->on_resent(setting_.timeline.now());
  states_.make(fleet, is_wanted, [this](const States& sample) { peer_.write(sample); });
}

void ServerProgram::record_step(const sim::Fleet& fleet) {
  for (const model::StepRecord& record : fleet.records()) {
    batches_->add(record);
    certificate_->add(record);
  }
  setting_.properties.on_recorded(core_->run_id(), fleet.records());
  if (++steps_ >= sim::RecordStream::kMostSteps) return write_records(false);
  if (steps_ > 1) return;
  process_.run_at(setting_.timeline.now() + sim::RecordStream::kLongestWait,
                  [this, number = flush_number_] {
                    if (number == flush_number_ && batches_->count() > 0) write_records(false);
                  });
}

void ServerProgram::record_late(const sim::Vehicle& vehicle, const sim::OfferedAnswer& offered) {
  setting_.properties.on_late(core_->run_id(), vehicle.record().vehicle_id, offered.step);
  batches_->add(sim::make_late_record(vehicle, offered));
}

void ServerProgram::write_records(bool is_last) {
  if (is_blocked_ && !is_last) return;
  ++flush_number_;
  // At its end the thread gives up what still waits.
  const bool is_lost = is_refused_ || is_blocked_;
  batches_->write(next_batch_, is_last, [&](const RecordBatch& batch) {
    if (!is_lost) peer_.write(batch);
  });
  (is_lost ? lost_ : written_) += batches_->count();
  batches_->clear();
  steps_ = 0;
}

// --- surroundings --------------------------------------------------------------------------------

std::vector<sync::Member> ServerProgram::find_members(ParticipantRole role,
                                                      std::uint64_t run_id) const {
  auto found = self().present_members().find(role, run_id);
  if (role == ParticipantRole::ROLE_CONTROLLER)
    sim::keep_matched(found, peer_.matched_readers(TopicId::kState),
                      peer_.matched_writers(TopicId::kCommand));
  return found;
}

std::vector<sync::Run> ServerProgram::find_other_runs() const {
  return self().present_servers().runs(now());
}

bool ServerProgram::is_known_elsewhere(std::uint64_t run_id) const {
  return self().present_servers().is_known(run_id, now());
}

bool ServerProgram::has_heard_every_claim() const {
  const auto& claimed = self().present_servers();
  for (const auto& peer : setting_.network.peers()) {
    if (peer->process().has_ended() || peer->id() == id()) continue;
    if (peer_.known().count(peer->id()) == 0) return false;  // not everybody was discovered
    if (peer->process().is_server() && !claimed.has_claimed(peer->id())) return false;
  }
  return true;
}

sim::Neighbourhood ServerProgram::find_neighbours() {
  sim::Neighbourhood seen;
  seen.participants = present_members().all();
  seen.add(present_servers().runs(now()));
  for (const bus::PeerId& peer : peer_.matched_writers(TopicId::kCommand))
    seen.command_writers[peer] = setting_.network.find(peer)->process().name();
  for (const bus::PeerId& peer : peer_.missing_deadlines())
    seen.missing_deadlines[peer] =
        setting_.network.find(peer)->process().name() + ": its writer offers no DEADLINE";
  seen.state_readers = peer_.matched_readers(TopicId::kState);
  return seen;
}

std::string ServerProgram::replace_problems(const std::map<std::string, std::string>& found) {
  std::string text;
  for (const auto& [key, problem] : found) text += (text.empty() ? "" : "; ") + problem;
  return text;
}

sim::Surroundings::Queues ServerProgram::queues() const {
  return {written_, peer_.history_depth(TopicId::kRecord) / batches_->batches_of_step(),
          self().peer_.missed_deadlines(TopicId::kCommand)};
}

std::optional<std::chrono::nanoseconds> ServerProgram::command_lifespan() const {
  if (!is_realtime()) return std::nullopt;
  return Peer::kRealtimeLimits.lifespan;
}

}  // namespace sls::worlds
