#include "sim_server/run.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>
#include <thread>
#include <utility>

#include "common/app/options.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/bus/convert.hpp"
#include "common/bus/names.hpp"
#include "common/config/vehicle_ids.hpp"
#include "sim_server/core/claim.hpp"
#include "sim_server/core/gathering.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

constexpr auto kRosterTime = 100ms;    // between checks for departure and silence
constexpr auto kRecorderSilence = 1s;  // until a recorder that is behind is reported
constexpr auto kReportInterval = 5s;   // between reports of the same silence
constexpr auto kLookInterval = 100ms;  // least time between checks of participants

}  // namespace

Run::Run(Endpoints& endpoints, const Assignment& assignment, WorkerPool& workers,
         std::uint64_t run_id, bool begins_paused)
    : endpoints_(endpoints),
      scenario_(assignment.scenario),
      vehicle_ids_(assignment.vehicle_ids),
      run_id_(run_id),
      board_([&endpoints](const SimStatus& status) { endpoints.status_writer.write(status); },
             run_id, vehicle_ids_.front(), scenario_.sync, [this] { return sum_counters(); }),
      control_(run_id, vehicle_ids_, begins_paused),
      check_(run_id, scenario_, vehicle_ids_),
      record_(endpoints.record_writer, endpoints.domain.max_batch_bytes(), run_id),
      workers_(workers),
      plants_(make_plants(find_plant_type(scenario_.plant.model), scenario_, vehicle_ids_)),
      plant_steps_(scenario_.sync.period_ns / scenario_.plant.step_ns) {
  for (const std::uint32_t id : vehicle_ids_) {
    vehicles_.push_back(std::make_unique<Vehicle>(scenario_, id, run_id));
    records_.push_back(&vehicles_.back()->record());
  }
  endpoints_.parameters_writer.write(make_parameters_message(
      run_id, vehicle_ids_, scenario_, *plants_.front().plant, app::version()));
  const config::Sync& sync = scenario_.sync;
  const std::string mode = sync.mode == config::SyncMode::kLockstep
                               ? "lockstep"
                               : fmt::format("real time × {}", sync.real_time_factor);
  spdlog::info("run {:016x}: {}, vehicle{} {}, {}, period {} s, step {} s", run_id, scenario_.name,
               vehicle_ids_.size() > 1 ? "s" : "", config::to_vehicle_ranges(vehicle_ids_), mode,
               sync.period_ns / 1e9, scenario_.plant.step_ns / 1e9);
}

Run::End Run::execute() {
  endpoints_.commands.take_all();  // removes commands of an earlier run
  if (wait_for_participants() && fly()) {
    finish();
    return End::kFinished;
  }
  if (control_.is_stop_requested()) throw app::RunError(control_.last_event());
  reset();
  return End::kReset;
}

void Run::fail(const std::string& reason) {
  close_requests(reason);
  // Before the claim is settled no participant has joined, so nothing is published.
  if (board_.has_published()) publish_end(RunPhase::PHASE_FAILED, reason);
}

void Run::finish() {
  close_requests("mission finished");
  publish_end(RunPhase::PHASE_FINISHED, "mission finished");
  const double wall_s = board_.calc_wall_s();
  const auto step = static_cast<double>(board_.step);
  const double simulated_s = step * static_cast<double>(scenario_.sync.period_ns) / 1e9;
  spdlog::info("finished: {} steps, {} s simulated in {:.2f} s, {:.0f} steps/s, {} resent, {}",
               board_.step, simulated_s, wall_s, step / wall_s, link_.resent(),
               board_.timing.label());
}

void Run::reset() {
  close_requests(control_.last_event());
  publish_end(RunPhase::PHASE_RESET, control_.last_event());
}

void Run::publish_end(RunPhase phase, const std::string& reason) {
  record_step();
  record_.end();
  announce_remarks();
  board_.publish(phase, reason);
}

void Run::close_requests(const std::string& reason) {
  for (const SimControlReply& reply : control_.end(board_.step, reason))
    endpoints_.reply_writer.write(reply);
}

// --- start ---------------------------------------------------------------------------------------

void Run::check_claim() const {
  const int progress = board_.has_published() ? sync::calc_progress(board_.phase()) : 0;
  const std::string error =
      describe_rival(endpoints_.servers.runs(), run_id_, vehicle_ids_, progress);
  if (!error.empty()) throw app::RunError(error);
}

void Run::check_stop() {
  if (app::stop_signal() != 0) throw app::RunError(app::describe_stop());
}

bool Run::wait_for_participants() {
  Gathering gathering(scenario_.sync.wait_for, scenario_.sha256, vehicle_ids_, Clock::now());
  const auto describe_obstacles = [this] {
    return describe_problem() + endpoints_.domain.describe_isolation();
  };
  board_.publish(RunPhase::PHASE_WAITING, "participants are not ready");
  while (true) {
    do_housekeeping();
    if (attend_to_operator()) return false;
    refresh_roster();
    const auto finding = gathering.look(roster_);
    if (finding == Gathering::Finding::kReady) return true;
    if (finding == Gathering::Finding::kGivenUp)
      throw app::RunError(gathering.describe_error() + describe_obstacles());
    if (const auto report = gathering.take_report(roster_.now)) {
      spdlog::info("{}{}{}", report->text, describe_obstacles(), report->hint);
      if (report->is_news)
        board_.publish(RunPhase::PHASE_WAITING, "missing: " + gathering.missing());
    }
    std::this_thread::sleep_for(app::kShortPollTime);
  }
}

// --- flight --------------------------------------------------------------------------------------

bool Run::fly() {
  board_.start_clock();
  began_ = Clock::now();
  board_.publish(control_.is_paused() ? RunPhase::PHASE_PAUSED : RunPhase::PHASE_RUNNING,
                 control_.last_event());
  begin();
  for (const PlantOfVehicles& group : plants_) measure(group);
  while (true) {
    if (board_.step > 0)
      if (const auto reply = control_.stepped(board_.step)) endpoints_.reply_writer.write(*reply);
    if (!rest() || !wait_for_recorders() || !exchange()) return false;
    board_.controller_name = vehicles_.front()->record().client_name;
    if (is_finished()) return true;
    advance();
    do_housekeeping();
  }
}

void Run::measure(const PlantOfVehicles& group) {
  const Plant& plant = *group.plant;
  for (std::size_t i = 0; i < group.vehicles.size(); ++i) {
    Vehicle& vehicle = *vehicles_[group.vehicles[i]];
    vehicle.measure(board_.step, plant.measurement(i),
                    plant.sees_truth() ? nullptr : &plant.seen(i));
    bus::fill(endpoints_.states.at(group.vehicles[i]), vehicle.id(), vehicle.record().seen(),
              vehicle.applied());
  }
}

void Run::publish_states() {
  const auto step = static_cast<std::int64_t>(board_.step);
  endpoints_.states.set_step(run_id_, board_.step, step * scenario_.sync.period_ns);
  is_step_published_ = true;
  endpoints_.states.write();
}

void Run::record_step() {
  if (!std::exchange(is_step_published_, false)) return;
  for (const auto& vehicle : vehicles_) vehicle->complete_record();
  record_.add_step(records_);
}

void Run::advance() {
  record_step();
  for (const auto& vehicle : vehicles_)
    board_.timing.add(vehicle->record().kind, vehicle->calc_age());
  ++board_.step;
  workers_.for_each(plants_.size(), [this](std::size_t i) { advance(plants_[i]); });
}

void Run::advance(PlantOfVehicles& group) {
  group.forces.clear();
  for (const std::size_t i : group.vehicles) group.forces.push_back(vehicles_[i]->actuate());
  try {
    group.plant->advance(group.forces, plant_steps_);
  } catch (const std::exception& error) {
    if (scenario_.vehicles.size() == 1) throw;
    throw std::runtime_error(
        fmt::format("vehicle {}: {}", vehicle_ids_[group.vehicles.front()], error.what()));
  }
  measure(group);
}

/// A vehicle whose mission is over flies on until all missions are over.
bool Run::is_finished() const {
  return std::all_of(vehicles_.begin(), vehicles_.end(),
                     [](const auto& vehicle) { return vehicle->is_finished(); });
}

bool Run::rest() {
  if (attend_to_operator()) return false;
  if (!control_.holds()) return true;
  const auto began = Clock::now();
  bool is_ended = false;
  record_.flush();
  while (control_.holds() && !is_ended) {
    do_housekeeping();
    if (is_roster_due()) refresh_roster();
    is_ended = attend_to_operator();
    if (!is_ended && control_.holds()) endpoints_.requests.wait(Clock::now() + app::kPollTime);
  }
  note_rest(Clock::now() - began);
  return !is_ended;
}

void Run::note_rest(Clock::duration rest) {
  board_.add_pause(rest);
  for (const auto& vehicle : vehicles_) vehicle->note_rest(rest);
  if (absence_wait_) absence_wait_->extend(rest);
  if (announced_absence_) *announced_absence_ += rest;
}

bool Run::is_meant_for_another_server(const SimControl& request) const {
  return request.run_id() != run_id_ && endpoints_.servers.is_known(request.run_id());
}

bool Run::attend_to_operator() {
  for (const SimControl& request : endpoints_.requests.take_all()) {
    if (is_meant_for_another_server(request)) continue;
    const std::uint64_t events = control_.events();
    if (const auto reply = control_.request(request, board_.step))
      endpoints_.reply_writer.write(*reply);
    if (control_.events() == events) continue;
    const RunPhase phase = board_.phase() == RunPhase::PHASE_WAITING ? RunPhase::PHASE_WAITING
                           : control_.is_paused()                    ? RunPhase::PHASE_PAUSED
                                                                     : RunPhase::PHASE_RUNNING;
    spdlog::info("step {}: {}", board_.step, control_.last_event());
    board_.publish(phase, control_.last_event());
  }
  return control_.is_reset_requested() || control_.is_stop_requested();
}

void Run::do_housekeeping() {
  if (!board_.is_due() && !is_look_due()) return;
  const std::string problem = board_.problem;
  look_for_problems();
  if (!board_.is_due() && board_.problem == problem) return;
  board_.publish(board_.phase(), control_.is_paused() ? control_.last_event() : "");
  check_stop();
  check_claim();
  report_silent_recorder();
}

std::map<bus::PeerId, Answering> Run::collect_answering() {
  // A client that has not answered need not do so while the run rests or waits for a recorder.
  const bool is_flying = is_step_published_ || roster_step_ != board_.step;
  roster_step_ = board_.step;
  std::map<bus::PeerId, Answering> answering;
  for (const auto& vehicle : vehicles_)
    vehicle->gate.for_each_client(
        [&](const bus::PeerId& peer, std::uint64_t answers, bool is_missing) {
          Answering& sum = answering[peer];
          sum.answers += answers;
          sum.is_asked = sum.is_asked || (is_missing && is_flying);
        });
  return answering;
}

void Run::refresh_roster() {
  roster_version_ = endpoints_.participants.version();
  roster_time_ = Clock::now();
  auto controllers = endpoints_.participants.find(ParticipantRole::ROLE_CONTROLLER, run_id_);
  presence_.look(controllers, collect_answering(), roster_time_);
  roster_ = {check_.admit_controllers(controllers),
             ParticipantCheck::admit_recorders(
                 endpoints_.participants.find(ParticipantRole::ROLE_RECORDER, run_id_)),
             began_, roster_time_};
  for (const auto& vehicle : vehicles_)
    vehicle->gate.set_clients(find_ready_clients(roster_, scenario_.sha256, vehicle->id()));
  roster_changed();
}

bool Run::is_roster_due() const {
  return endpoints_.participants.version() != roster_version_ ||
         Clock::now() - roster_time_ > kRosterTime;
}

bool Run::is_look_due() const {
  const auto& due = check_.next_due();
  const bool is_news = endpoints_.domain.problems().version() != problems_version_ ||
                       endpoints_.participants.version() != looked_at_version_;
  if (!is_news && !due) return false;
  const auto now = Clock::now();
  return now - look_time_ >= kLookInterval && (is_news || now >= *due);
}

void Run::look_for_problems() {
  const bus::Node& domain = endpoints_.domain;
  Neighbourhood neighbourhood;
  neighbourhood.now = look_time_ = Clock::now();
  looked_at_version_ = endpoints_.participants.version();
  neighbourhood.participants = endpoints_.participants.all();
  for (const sync::Run& other : endpoints_.servers.runs()) {
    neighbourhood.other_runs.insert(other.parameters.run_id());
    for (const std::uint32_t id : sync::list_vehicle_ids(other.parameters))
      neighbourhood.other_vehicles.insert(id);
  }
  for (const bus::PeerId& peer : endpoints_.command_stream.matched())
    neighbourhood.command_writers[peer] = domain.describe(peer);
  neighbourhood.is_on_network = !domain.stays_on_this_machine();
  neighbourhood.announcement_writers = endpoints_.participants.writers();
  neighbourhood.state_readers = endpoints_.states.matched();
  neighbourhood.informed = find_informed();
  neighbourhood.stamps_ahead_s = endpoints_.command_stream.take_stamps_ahead();
  endpoints_.servers.look_for_impostors();
  neighbourhood.missing_deadlines = domain.find_missing_deadlines();
  neighbourhood.explained = domain.find_misfits();
  bus::Problems& problems = endpoints_.domain.problems();
  problems.replace("run ", check_.look(neighbourhood));
  problems_version_ = problems.version();
  board_.problem = problems.describe();
  for (const std::string& event : check_.take_events()) board_.announce(event);
  announce_remarks();
}

/// Participants that have acknowledged the parameters and a status of this run.
const std::set<bus::PeerId>& Run::find_informed() {
  const auto has_all = [](auto& writer) { return writer.wait_for_acknowledgments(0ms); };
  const auto readers = endpoints_.status_writer.matched();
  const auto of_parameters = endpoints_.parameters_writer.matched();
  if (!board_.has_published() || !has_all(endpoints_.status_writer) ||
      !has_all(endpoints_.parameters_writer))
    return informed_;
  std::set_intersection(readers.begin(), readers.end(), of_parameters.begin(), of_parameters.end(),
                        std::inserter(informed_, informed_.end()));
  return informed_;
}

void Run::announce_remarks() {
  for (const PlantOfVehicles& group : plants_)
    for (std::size_t i = 0; i < group.vehicles.size(); ++i)
      for (const std::string& remark : group.plant->take_remarks(i))
        board_.announce(fmt::format("vehicle {}: {}", vehicle_ids_[group.vehicles[i]], remark));
}

void Run::report_silent_recorder() {
  if (board_.phase() != RunPhase::PHASE_RUNNING) return;
  const auto now = Clock::now();
  if (recorder_report_time_ && now - *recorder_report_time_ < kReportInterval) return;
  const std::string silent = name_silent_recorder(roster_, board_.step, now - kRecorderSilence);
  if (silent.empty()) return;
  recorder_report_time_ = now;
  board_.announce(fmt::format("step {}: {}", board_.step, silent));
}

}  // namespace sls::sim
