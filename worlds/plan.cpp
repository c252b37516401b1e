#include "worlds/plan.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "common/config/vehicle_ids.hpp"
#include "worlds/setting.hpp"

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;
using Kind = Fault::Kind;
namespace faults = config::faults;

constexpr auto kStep = static_cast<std::size_t>(ControlAction::ACTION_STEP);

Instant draw_time(Random& random, Instant least, Instant most) {
  return Instant(random.integer(least.count(), most.count()));
}

Link draw_link(Random& random) {
  Link link;
  switch (random.integer(0, 4)) {
    case 0:  // one switch
      break;
    case 1:  // Wi-Fi
      link = {1ms, 4ms, random.between(0, 0.05), 0.05, 20ms, false};
      break;
    case 2:  // far away
      link = {10ms, 1ms, random.between(0, 0.01), 0.01, 5ms, false};
      break;
    default:
      link.delay = draw_time(random, 20us, 2ms);
      link.jitter = draw_time(random, 0us, 2ms);
      link.loss = random.chance(0.5) ? random.between(0, 0.2) : 0;
      link.reordering = random.chance(0.3) ? random.between(0, 0.2) : 0;
      link.late_by = 10ms;
  }
  if (random.chance(0.2)) link.duplicates = random.between(0, 0.3);
  if (random.chance(0.1)) link.packet_time = calc_packet_time(random.between(2, 50));
  return link;
}

/// A step of the flight, but not one of the last `margin`.
std::uint64_t draw_step(Random& random, const FlownScenario& flown, std::uint64_t margin = 0) {
  return random.index(flown.last_step - margin + 1);
}

Instant draw_seconds(Random& random, double least, double most) {
  return sync::to_duration(random.between(least, most));
}

double draw(Random& random, const faults::Span& span) {
  return random.between(span.least, span.most);
}

/// The link of a file, by default as good as a switch.
Link make_link(const faults::Link& given, Random& random) {
  Link link;
  const auto set_time = [&](Instant& time, const std::optional<faults::Span>& ms) {
    if (ms) time = sync::to_duration(draw(random, *ms) * 1e-3);
  };
  set_time(link.delay, given.delay_ms);
  set_time(link.jitter, given.jitter_ms);
  link.late_by = 10ms;
  set_time(link.late_by, given.reordering_ms);
  link.loss = draw(random, given.loss.value_or(faults::Span()));
  link.reordering = draw(random, given.reordering.value_or(faults::Span()));
  link.duplicates = draw(random, given.duplicates.value_or(faults::Span()));
  if (given.bandwidth_mbit)
    link.packet_time = calc_packet_time(draw(random, *given.bandwidth_mbit));
  return link;
}

/// The place of a program in the plan.
std::optional<std::size_t> find_program(const Plan& plan, const faults::Program& named) {
  int number = 0;
  for (std::size_t i = 0; i < plan.programs.size(); ++i)
    if (plan.programs[i].role == static_cast<Role>(named.role) && ++number == named.number)
      return i;
  return std::nullopt;
}

/// Makes some clients announce something false about themselves.
void draw_habits(PlannedProgram& client, Random& random) {
  client.has_library = random.chance(0.03);
  client.says_done = random.chance(0.02);
  if (!random.chance(0.04)) return;
  client.announced_name = "controller-1";
  client.strength = 3;
}

/// Two servers share the fleet: another one flies all vehicles but the first, with as many clients
/// and recorders.
void share_fleet(Plan& plan, Random& random) {
  const std::vector<std::uint32_t> ids = plan.programs.front().vehicle_ids;
  std::vector<PlannedProgram> others;
  for (PlannedProgram& program : plan.programs) {
    if (program.role == Role::kForeign) continue;
    PlannedProgram& other = others.emplace_back(program);
    other.host = random.index(plan.hosts);
    other.start = draw_time(random, 0ms, 1500ms);
    other.vehicle_ids.assign(ids.begin() + 1, ids.end());
    program.vehicle_ids = {ids.front()};
  }
  plan.programs.insert(plan.programs.end(), others.begin(), others.end());
}

/// The first client flies the first vehicle, the second one the others.
void share_among_clients(Plan& plan) {
  std::vector<PlannedProgram*> clients;
  for (PlannedProgram& program : plan.programs)
    if (program.role == Role::kClient) clients.push_back(&program);
  const std::vector<std::uint32_t> ids = clients[0]->vehicle_ids;
  clients[1]->vehicle_ids.assign(ids.begin() + 1, ids.end());
  clients[0]->vehicle_ids = {ids.front()};
}

void draw_programs(Plan& plan, Random& random, const FlownScenario& flown,
                   const faults::Case* given) {
  const config::WaitFor& expected = flown.scenario.sync.wait_for;
  const auto add = [&](Role role) -> PlannedProgram& {
    PlannedProgram& program = plan.programs.emplace_back();
    program.role = role;
    program.host = random.index(plan.hosts);
    program.start = draw_time(random, 0ms, 1500ms);
    program.vehicle_ids = config::parse_vehicle_ids("all", flown.scenario.vehicles.size());
    program.follows_servers = plan.promise == Promise::kServerRestart || random.chance(0.4);
    return program;
  };
  add(Role::kServer);
  const bool is_wild = plan.promise == Promise::kNone && !given;
  const bool is_calm = plan.promise == Promise::kCalm;
  const bool is_realtime = flown.scenario.sync.mode == config::SyncMode::kRealtime;
  if (is_wild && random.chance(0.25)) add(Role::kServer);
  if (plan.promise == Promise::kTwoServers)
    add(Role::kServer).start = plan.programs.front().start + draw_time(random, 0ms, 800ms);
  // A server that was started again, or second, waits for the expected ones alone. One that nobody
  // waits for may miss the flight after a reset.
  const bool has_surplus = plan.promise != Promise::kServerRestart &&
                           plan.promise != Promise::kTwoServers && plan.promise != Promise::kReset;
  const bool joins_in_flight = is_calm && is_realtime;
  const bool has_standby = plan.promise == Promise::kTakeOver || joins_in_flight;
  const int clients = expected.controllers +
                      (has_standby ? 1 : static_cast<int>(random.integer(0, has_surplus ? 1 : 0)));
  for (int i = 0; i < clients; ++i) {
    PlannedProgram& client = add(Role::kClient);
    client.strength = static_cast<std::int32_t>(random.integer(0, 3));
    if (joins_in_flight && i == expected.controllers) {
      client.start = draw_time(random, 1s, 3s);
      client.strength = 3;
    }
    client.announces_once = random.chance(0.1);
    if (!is_calm && random.chance(0.1)) client.delay = draw_time(random, 100us, 3ms);
    if (is_wild && random.chance(0.03)) client.has_other_scenario = true;
    client.is_early = is_calm && is_realtime && random.chance(0.5);
    if (is_wild && random.chance(0.1)) client.breaks_at = draw_step(random, flown);
    client.is_sloppy = random.chance(0.2);
    if (is_wild) draw_habits(client, random);
  }
  if (random.chance(0.15)) {
    PlannedProgram& foreign = add(Role::kForeign);
    foreign.is_wild = is_wild;
    foreign.is_crowd = is_wild && random.chance(0.01);
  }
  const int recorders =
      std::max(expected.recorders, static_cast<int>(random.integer(0, has_surplus ? 2 : 0)));
  for (int i = 0; i < recorders; ++i) {
    PlannedProgram& recorder = add(Role::kRecorder);
    recorder.resumes = plan.promise == Promise::kRecorderRestart || random.chance(0.7);
    if (!is_calm && random.chance(0.1)) recorder.delay = draw_time(random, 1ms, 100ms);
    if (is_wild && random.chance(0.05))
      recorder.queue = static_cast<std::size_t>(random.integer(1, 50));
  }
  const bool has_fleet = flown.scenario.vehicles.size() > 1 && flown.failure.empty();
  // All programs are suspended when one server has a step: those of another one may not be there.
  if (!given && has_fleet && plan.promise != Promise::kServerRestart &&
      plan.promise != Promise::kTwoServers && plan.promise != Promise::kSuspend &&
      random.chance(0.25))
    share_fleet(plan, random);
  else if (!given && has_fleet && !has_standby && expected.controllers == 1 && clients == 2 &&
           random.chance(0.5))
    share_among_clients(plan);
  if (!given) return;
  const auto need = [&](const faults::Program& named) {
    while (!find_program(plan, named)) add(static_cast<Role>(named.role));
  };
  for (const faults::Fault& fault : given->faults) {
    need(fault.program);
    need(fault.to);
    // Nothing passes between programs of one host that could be cut.
    const std::size_t from = plan.programs[*find_program(plan, fault.program)].host;
    std::size_t& to = plan.programs[*find_program(plan, fault.to)].host;
    if (fault.kind == Kind::kCut && to == from) to = (from + 1) % plan.hosts;
  }
  for (PlannedProgram& program : plan.programs) program.follows_servers = program.resumes = true;
}

void time_fault(Fault& fault, Random& random, const Plan& plan, const FlownScenario& flown) {
  if (random.chance(0.6)) {
    fault.step = draw_step(random, flown);
    fault.at = random.chance(0.5) ? Instant(0) : draw_time(random, 0us, 5ms);
  } else {
    fault.at = draw_time(random, 0ms, plan.healed);
  }
}

/// One of the programs with this role.
std::size_t draw_program(Random& random, const Plan& plan, Role role) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < plan.programs.size(); ++i)
    if (plan.programs[i].role == role) found.push_back(i);
  return found[random.index(found.size())];
}

/// `count`: of all faults of the plan.
Fault draw_fault(const Plan& plan, Random& random, std::int64_t count) {
  static constexpr Kind kMild[] = {Kind::kStop, Kind::kCut,   Kind::kIsolate,   Kind::kLoss,
                                   Kind::kSlow, Kind::kClock, Kind::kPartition, Kind::kClog};
  Fault fault;
  fault.kind = plan.promise == Promise::kMild ? kMild[random.integer(0, 7)]
                                              : static_cast<Kind>(random.integer(0, 12));
  const std::size_t programs = plan.programs.size();
  // A server that has ended waits 1 s for the others to hear it.
  const bool is_mild = plan.promise == Promise::kMild;
  const Instant longest = is_mild              ? Instant(900ms) / count
                          : random.chance(0.3) ? Instant(15s)
                                               : Instant(3s);
  fault.duration = draw_time(random, 1ms, longest);
  switch (fault.kind) {
    case Kind::kKill:
    case Kind::kPowerCut:
      fault.target = random.index(programs);
      if (random.chance(0.5)) fault.duration = Instant(0);
      break;
    case Kind::kStop:
    case Kind::kInterrupt:
    case Kind::kDiskFull:
      fault.target = random.index(programs);
      break;
    case Kind::kCut:
    case Kind::kIsolate:
      fault.target = random.index(plan.hosts);
      fault.other = random.index(plan.hosts);
      break;
    case Kind::kLoss:
      fault.value = random.between(0.05, is_mild ? 0.3 : 0.9);
      break;
    case Kind::kSlow:
      fault.target = random.index(programs);
      fault.value = random.between(0.0005, is_mild ? 0.02 : 0.3);
      break;
    case Kind::kClock:
      fault.target = random.index(plan.hosts);
      fault.value = random.between(-30, 30);
      break;
    case Kind::kRequest:
      fault.target = draw_program(random, plan, Role::kServer);
      fault.other = random.index(6);
      fault.value = static_cast<double>(random.integer(1, 20));
      break;
    case Kind::kPartition:
    case Kind::kStall:
    case Kind::kRefuse:
    case Kind::kBlock:
      break;
    case Kind::kClog:
      fault.value = random.between(0.3, 4);
      break;
  }
  return fault;
}

/// Longest stop of a client in a world of kLongStop, before it is absent for too long.
double calc_longest_stop_s(const config::Sync& sync) { return sync.wait.controller.deadline_s - 2; }

/// A promise holds only if 8 s are enough for what happens, and all but one only if policies wait.
Promise draw_promise(Random& random, const FlownScenario& flown) {
  const config::Sync& sync = flown.scenario.sync;
  const double choice = random.uniform();
  if (choice < 0.04 && flown.failure.empty()) return Promise::kSuspend;
  if (choice < 0.35 || !flown.failure.empty()) return Promise::kNone;
  const bool is_realtime = sync.mode == config::SyncMode::kRealtime;
  if (choice < (is_realtime ? 0.55 : 0.42)) return Promise::kCalm;
  if (sync.wait.controller.policy != config::ControllerPolicy::kWait ||
      sync.wait.recorder.policy == config::RecorderPolicy::kStop)
    return Promise::kNone;
  if (choice < 0.6) return Promise::kMild;
  if (choice < 0.68) return Promise::kTakeOver;
  if (choice < 0.74) return Promise::kReset;
  if (choice < 0.8) return Promise::kPause;
  if (choice < 0.84) return Promise::kTwoServers;
  if (choice < 0.9 && sync.wait.server_deadline_s + 1 < calc_longest_stop_s(sync))
    return Promise::kLongStop;
  if (choice < 0.95 || sync.wait_for.recorders == 0) return Promise::kServerRestart;
  return Promise::kRecorderRestart;
}

/// Two silences of the server, with a pause between them that is longer than it may be silent.
void draw_silences(Plan& plan, Random& random, const FlownScenario& flown) {
  const auto third = static_cast<std::int64_t>(flown.last_step / 3);
  for (std::int64_t i = 0; i < 3; ++i) {
    Fault fault;
    fault.step = static_cast<std::uint64_t>(random.integer(i * third, (i + 1) * third - 2));
    fault.kind = i == 1 ? Kind::kRequest : Kind::kStop;
    fault.other = static_cast<std::size_t>(ControlAction::ACTION_PAUSE);
    const double longest_s = flown.scenario.sync.wait.server_deadline_s;
    const double least_s = i == 1 ? longest_s + 1 : 1.2;
    fault.duration = draw_seconds(random, least_s, least_s + 0.5);
    plan.faults.push_back(fault);
  }
}

/// Stops that are nobody's absence, whatever the policies.
void draw_suspension(Plan& plan, Random& random, const FlownScenario& flown) {
  const bool is_of_server = random.chance(0.5);
  Fault stop;
  stop.kind = Kind::kStop;
  if (random.chance(0.7)) {
    stop.step = draw_step(random, flown, 5);
  } else {
    for (const PlannedProgram& program : plan.programs) stop.at = std::max(stop.at, program.start);
    stop.at += draw_time(random, 0ms, 2s);
  }
  const config::Sync& sync = flown.scenario.sync;
  const double others_wait_s = std::min(sync.wait.server_deadline_s, sync.wait_for.timeout_s);
  // They wait since their own starts, and a server claims its vehicles for a second.
  const Instant duration = draw_seconds(random, 0.5, is_of_server ? others_wait_s - 4 : 20);
  for (stop.target = 0; stop.target < plan.programs.size(); ++stop.target) {
    if (is_of_server && plan.programs[stop.target].role != Role::kServer) continue;
    stop.duration = duration + draw_time(random, 0ms, 20ms);  // they go on one after another
    plan.faults.push_back(stop);
  }
}

/// Two servers that do not hear each other, and both are heard by others. Each may be killed.
void draw_split(Plan& plan, Random& random, const FlownScenario& flown) {
  plan.hosts = std::max<std::size_t>(plan.hosts, 3);
  for (std::size_t i = 0; i < 2; ++i) {
    plan.programs[i].host = i;
    Fault cut;
    cut.kind = Kind::kCut;
    cut.target = i;
    cut.other = 1 - i;
    cut.duration = plan.healed;
    plan.faults.push_back(cut);
    if (random.chance(0.5)) continue;
    Fault kill;
    kill.target = i;
    kill.step = draw_step(random, flown);
    plan.faults.push_back(kill);
  }
}

/// An operator pauses the flight for longer than anybody may be absent. In half of the worlds one
/// of the clients is slow before and after, so that answers are late in real time.
void draw_pause(Plan& plan, Random& random, const FlownScenario& flown) {
  Fault pause;
  pause.kind = Kind::kRequest;
  pause.target = draw_program(random, plan, Role::kServer);
  pause.other = static_cast<std::size_t>(ControlAction::ACTION_PAUSE);
  const double patience_s = flown.scenario.sync.calc_controller_patience_s();
  pause.duration = draw_seconds(random, random.chance(0.7) ? patience_s : 1, patience_s + 10);
  pause.step = draw_step(random, flown, 5);
  plan.faults.push_back(pause);
  if (random.chance(0.5)) return;
  Fault slow = pause;
  slow.kind = Kind::kSlow;
  slow.target = draw_program(random, plan, Role::kClient);
  slow.step = *pause.step - std::min<std::uint64_t>(*pause.step, 10);
  slow.duration += 1s;
  slow.value = random.between(0.0005, 0.02);
  plan.faults.push_back(slow);
}

/// The flight is paused when the recorder of `kill`, its only fault, is killed, until the others
/// know that it is dead. It comes back long after, or never.
void pause_until_known(Plan& plan, Random& random, bool comes_back) {
  Fault& kill = plan.faults.front();
  const Instant absence = draw_time(random, 5s, 7s);
  kill.duration = comes_back ? absence : Instant(0);
  Fault pause;
  pause.kind = Kind::kRequest;
  pause.step = kill.step;
  pause.other = static_cast<std::size_t>(ControlAction::ACTION_PAUSE);
  pause.duration = draw_time(random, 3500ms, 4s);
  plan.healed = pause.duration;
  plan.faults.push_back(pause);
}

/// Runs one after another, each paused for longer than anybody may be absent, then reset. A fault
/// happens once, so each one has a later step than that of the run before.
void draw_runs(Plan& plan, Random& random, const FlownScenario& flown) {
  const std::int64_t runs = random.integer(2, 4);
  const auto part = static_cast<std::int64_t>(flown.last_step) / (runs + 1);
  for (std::int64_t i = 0; i < runs; ++i) {
    Fault request;
    request.kind = Kind::kRequest;
    request.step = static_cast<std::uint64_t>(random.integer(i * part, (i + 1) * part - 2));
    request.other = static_cast<std::size_t>(ControlAction::ACTION_PAUSE);
    request.duration = draw_seconds(random, 4, 12);
    plan.faults.push_back(request);
    request.step = static_cast<std::uint64_t>((i + 1) * part - 1);
    request.other = static_cast<std::size_t>(ControlAction::ACTION_RESET);
    plan.faults.push_back(request);
  }
  plan.healed = 60s;
}

/// The one fault of a world with a promise that names it.
Fault draw_promised(const Plan& plan, Random& random, const FlownScenario& flown) {
  const config::Sync& sync = flown.scenario.sync;
  Fault fault;
  Role role = Role::kServer;
  switch (plan.promise) {
    case Promise::kTakeOver:
      role = Role::kClient;
      break;
    case Promise::kServerRestart:
      fault.duration = draw_time(random, 1ms, 3s);
      break;
    case Promise::kRecorderRestart:
      role = Role::kRecorder;
      fault.duration = draw_time(random, 1ms, 3s);
      break;
    case Promise::kReset:
      fault.kind = Kind::kRequest;
      fault.other = static_cast<std::size_t>(ControlAction::ACTION_RESET);
      break;
    default:
      fault.kind = Kind::kStop;
      role = Role::kClient;
      fault.duration =
          draw_seconds(random, sync.wait.server_deadline_s + 1, calc_longest_stop_s(sync));
  }
  fault.target = draw_program(random, plan, role);
  fault.step = draw_step(random, flown, 5);
  return fault;
}

/// The fault of a file. All programs of the plan are there.
Fault make_fault(const faults::Fault& given, const Plan& plan, Random& random) {
  const std::size_t program = *find_program(plan, given.program);
  const bool is_of_host =
      given.kind == Kind::kCut || given.kind == Kind::kIsolate || given.kind == Kind::kClock;
  const auto draw_whole = [&](const faults::Span& span) {
    return random.integer(static_cast<std::int64_t>(span.least),
                          static_cast<std::int64_t>(span.most));
  };
  Fault fault;
  fault.kind = given.kind;
  if (given.is_at_step)
    fault.step = static_cast<std::uint64_t>(draw_whole(given.at));
  else
    fault.at = sync::to_duration(draw(random, given.at));
  fault.target = is_of_host ? plan.programs[program].host : program;
  fault.duration = sync::to_duration(draw(random, given.for_s));
  fault.value = draw(random, given.value);
  if (given.restart_s)  // at once is after a moment
    fault.duration = std::max(Instant(1ms), sync::to_duration(draw(random, *given.restart_s)));
  if (given.kind == Kind::kCut) fault.other = plan.programs[*find_program(plan, given.to)].host;
  if (given.kind == Kind::kRequest) {
    fault.other = static_cast<std::size_t>(given.action);
    fault.value = static_cast<double>(draw_whole(given.value));
  }
  return fault;
}

/// About when `fault` is over.
Instant estimate_end(const Fault& fault, const Plan& plan, const config::Sync& sync) {
  const Instant round_trip = 2 * (plan.link.delay + plan.link.jitter) + 1ms;
  const Instant period =
      sync::to_duration(static_cast<double>(sync.period_ns) * 1e-9 / sync.real_time_factor);
  const Instant begin =
      fault.step ? 3s + static_cast<std::int64_t>(*fault.step) * std::max(round_trip, period)
                 : fault.at;
  return begin + fault.duration + 100ms;
}

/// An operator pauses the flight for a request of steps, and sends others at once or while it is
/// carried out.
void draw_session(Plan& plan, Random& random, Fault request) {
  request.value = static_cast<double>(random.integer(1, 100));
  const Fault steps = request;
  request.other = static_cast<std::size_t>(ControlAction::ACTION_PAUSE);
  plan.faults.push_back(request);
  plan.faults.push_back(steps);
  const std::int64_t more = random.integer(0, 4);
  for (std::int64_t i = 0; i < more; ++i) {
    request.other = random.index(6);
    if (random.chance(0.5)) request.at += draw_time(random, 0us, 100ms);
    plan.faults.push_back(request);
  }
}

/// A recorder that is expected never comes back.
void draw_lost_recorder(Plan& plan, Random& random, const FlownScenario& flown) {
  const auto is_recorder = [](const PlannedProgram& program) {
    return program.role == Role::kRecorder;
  };
  const auto recorder = std::find_if(plan.programs.begin(), plan.programs.end(), is_recorder);
  Fault kill;
  kill.kind = Kind::kKill;
  kill.target = static_cast<std::size_t>(recorder - plan.programs.begin());
  kill.step = draw_step(random, flown, 5);
  plan.faults.push_back(kill);
  pause_until_known(plan, random, false);
}

/// Writes that are refused or wait, and short leases with a silence that is longer.
void draw_hindrances(Plan& plan, Random& random, const FlownScenario& flown) {
  const auto add = [&](Kind kind, std::size_t target, Instant duration) {
    Fault fault;
    fault.kind = kind;
    fault.target = target;
    fault.duration = duration;
    time_fault(fault, random, plan, flown);
    plan.faults.push_back(fault);
  };
  if (random.chance(0.04))
    add(Kind::kRefuse, draw_program(random, plan, Role::kServer), draw_time(random, 1ms, 3s));
  if (random.chance(0.08))
    add(Kind::kBlock, draw_program(random, plan, Role::kServer), draw_time(random, 1ms, 5s));
  if (!random.chance(0.1)) return;
  plan.lease = draw_time(random, 1s, 4s);
  const Instant silence = plan.lease + draw_time(random, 0s, 4s);
  plan.healed += silence;
  if (random.chance(0.5))
    add(Kind::kStop, random.index(plan.programs.size()), silence);
  else
    add(Kind::kIsolate, random.index(plan.hosts), silence);
}

/// The faults of a plan that has its programs.
void draw_faults(Plan& plan, Random& random, const FlownScenario& flown) {
  if (plan.promise == Promise::kCalm || plan.promise == Promise::kTwoServers) return;
  if (plan.promise == Promise::kLongStop && random.chance(0.5))
    return draw_silences(plan, random, flown);
  if (plan.promise == Promise::kPause) return draw_pause(plan, random, flown);
  if (plan.promise == Promise::kSuspend) return draw_suspension(plan, random, flown);
  if (plan.promise == Promise::kReset && random.chance(0.5)) return draw_runs(plan, random, flown);
  if (plan.promise > Promise::kMild) {
    plan.faults.push_back(draw_promised(plan, random, flown));
    if (plan.promise == Promise::kRecorderRestart && random.chance(0.5))
      pause_until_known(plan, random, true);
    return;
  }
  if (plan.promise == Promise::kNone && plan.programs[1].role == Role::kServer &&
      random.chance(0.3))
    return draw_split(plan, random, flown);
  if (plan.promise == Promise::kNone && flown.scenario.sync.wait_for.recorders > 0 &&
      random.chance(0.05))
    return draw_lost_recorder(plan, random, flown);
  const std::int64_t faults = random.chance(0.15) ? 0 : random.integer(1, 6);
  for (std::int64_t i = 0; i < faults; ++i) {
    Fault fault = draw_fault(plan, random, faults);
    time_fault(fault, random, plan, flown);
    const bool is_step = fault.kind == Kind::kRequest && fault.other == kStep;
    if (is_step && random.chance(0.8))
      draw_session(plan, random, fault);
    else
      plan.faults.push_back(fault);
  }
}

}  // namespace

const char* name_promise(Promise promise) {
  static constexpr const char* kNames[] = {
      "no promise", "mild",  "take-over", "server restart", "recorder restart", "calm",
      "reset",      "pause", "long stop", "two servers",    "suspended"};
  return kNames[static_cast<int>(promise)];
}

faults::Abilities list_abilities() {
  faults::Abilities abilities{
      "worlds",
      {"link.delay_ms", "link.jitter_ms", "link.loss", "link.reordering", "link.reordering_ms",
       "link.duplicates", "link.bandwidth_mbit", "step", "until_s"},
      {}};
  for (const auto& kind : names_of(Kind())) abilities.words.insert(kind.text);
  return abilities;
}

Plan draw_plan(std::uint64_t seed, const std::vector<FlownScenario>& scenarios,
               const std::vector<faults::Case>& cases) {
  Random random(Random(seed).next());
  Plan plan;
  plan.seed = seed;
  plan.scenario = random.index(scenarios.size());
  const FlownScenario& flown = scenarios[plan.scenario];
  const bool is_lockstep = flown.scenario.sync.mode == config::SyncMode::kLockstep;
  const faults::Case* given = cases.empty() ? nullptr : &cases[random.index(cases.size())];
  if (!given) plan.promise = draw_promise(random, flown);
  plan.hosts = static_cast<std::size_t>(random.integer(given ? 2 : 1, 4));
  plan.link = given ? make_link(given->link, random)
              : plan.promise == Promise::kCalm || plan.promise == Promise::kSuspend
                  ? Link()
                  : draw_link(random);
  // With much loss two servers may receive each other's claims only after both have begun to wait
  // for participants: with 0.02 this happened in one of 650,000 worlds of all kinds, seed 620959.
  if (plan.promise == Promise::kTwoServers) plan.link.loss = std::min(plan.link.loss, 0.005);
  plan.drift = random.chance(0.3) ? random.between(-1e-4, 1e-4) : 0;
  plan.wall_offset_s = random.chance(0.3) ? random.between(-20, 20) : 0;
  plan.healed = draw_time(random, 1s, is_lockstep ? Instant(6s) : Instant(4s));
  if (plan.promise == Promise::kLongStop || plan.promise == Promise::kPause ||
      plan.promise == Promise::kSuspend)
    plan.healed = 60s;
  plan.has_files = plan.promise == Promise::kRecorderRestart || random.chance(0.08);
  draw_programs(plan, random, flown, given);
  if (given) {
    for (const faults::Fault& fault : given->faults) {
      plan.faults.push_back(make_fault(fault, plan, random));
      plan.healed =
          std::max(plan.healed, estimate_end(plan.faults.back(), plan, flown.scenario.sync));
    }
    if (given->until_s) plan.healed = sync::to_duration(draw(random, *given->until_s));
    return plan;
  }
  if (plan.promise == Promise::kNone && random.chance(0.1))
    plan.record_history = static_cast<std::size_t>(random.integer(5, 50));
  draw_faults(plan, random, flown);
  if (plan.promise == Promise::kNone && random.chance(0.15)) {
    Fault stall;
    stall.kind = Kind::kStall;
    time_fault(stall, random, plan, flown);
    stall.duration = draw_time(random, 1ms, random.chance(0.3) ? Instant(15s) : Instant(3s));
    plan.faults.push_back(stall);
  }
  // Faults then last beyond every deadline.
  if (plan.promise == Promise::kNone && random.chance(0.2))
    plan.healed += draw_time(random, 0s, 30s);
  if (plan.promise == Promise::kNone) draw_hindrances(plan, random, flown);
  return plan;
}

std::string name_program(const Plan& plan, std::size_t index) {
  static constexpr const char* kNames[] = {"server", "controller", "recorder", "operator",
                                           "foreign"};
  int number = 1;
  for (std::size_t i = 0; i < index; ++i)
    number += plan.programs[i].role == plan.programs[index].role;
  return fmt::format("{}-{}", kNames[static_cast<int>(plan.programs[index].role)], number);
}

std::string describe(const Fault& fault) {
  const double at = sync::to_seconds(fault.at);
  const std::string when =
      fault.step ? fmt::format("step {} + {:.6f} s", *fault.step, at) : fmt::format("{:.6f} s", at);
  return fmt::format("{} at {}: target {}, other {}, for {:.6f} s, value {:.4f}",
                     config::to_yaml_value(fault.kind), when, fault.target, fault.other,
                     sync::to_seconds(fault.duration), fault.value);
}

std::vector<std::string> describe(const Plan& plan) {
  const auto to_ms = [](Instant time) {
    return std::chrono::duration<double, std::milli>(time).count();
  };
  std::vector<std::string> lines = {fmt::format(
      "seed {}: scenario {}, {} host(s), link {:.3f} ms + {:.3f} ms, loss {:.4f}, {} faults, {}",
      plan.seed, plan.scenario, plan.hosts, to_ms(plan.link.delay), to_ms(plan.link.jitter),
      plan.link.loss, plan.faults.size(), name_promise(plan.promise))};
  for (std::size_t i = 0; i < plan.programs.size(); ++i) {
    const PlannedProgram& program = plan.programs[i];
    std::string line = fmt::format("{} on host {} at {:.3f} ms: strength {}, delay {:.3f} ms",
                                   name_program(plan, i), program.host, to_ms(program.start),
                                   program.strength, to_ms(program.delay));
    for (const Trait& trait : kTraits)
      if (program.*trait.flag) line += std::string(", ") + trait.words;
    if (program.queue != record::Arrivals::kMostEntries)
      line += fmt::format(", queue of {} entries", program.queue);
    if (program.breaks_at) line += fmt::format(", breaks at step {}", *program.breaks_at);
    lines.push_back(std::move(line));
  }
  for (const Fault& fault : plan.faults) lines.push_back(describe(fault));
  return lines;
}

}  // namespace sls::worlds
