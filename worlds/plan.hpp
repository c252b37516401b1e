/// The plan of a world, drawn from its seed before it begins: programs, network, faults.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/config/faults.hpp"
#include "recorder/core/arrivals.hpp"
#include "worlds/network.hpp"
#include "worlds/random.hpp"

namespace sls::worlds {

struct FlownScenario;

enum class Role { kServer, kClient, kRecorder, kOperator, kForeign };

/// One fault or one act of a person.
struct Fault {
  /// `target` is a host for cut, isolate and clock, otherwise a program; `other` is a host for cut,
  /// otherwise SimControl.action. After `duration` a killed program begins again, if that is not 0.
  using Kind = config::faults::Kind;
  Kind kind = Kind::kKill;
  Instant at{0};                      ///< after the start, or after the step
  std::optional<std::uint64_t> step;  ///< when a server publishes this step
  Instant duration{0};
  std::size_t target = 0;
  std::size_t other = 0;
  double value = 0;

  bool is_of_program() const {
    return kind == Kind::kKill || kind == Kind::kPowerCut || kind == Kind::kStop ||
           kind == Kind::kInterrupt || kind == Kind::kSlow || kind == Kind::kDiskFull ||
           kind == Kind::kRequest || kind == Kind::kRefuse || kind == Kind::kBlock;
  }
};

struct PlannedProgram {
  Role role = Role::kClient;
  std::size_t host = 0;
  Instant start{0};
  std::vector<std::uint32_t> vehicle_ids;
  std::int32_t strength = 0;
  bool follows_servers = false;
  bool has_other_scenario = false;
  bool is_sloppy = false;       ///< a client that also sends what nobody asked for
  bool is_early = false;        ///< a client that also answers the next step before its state
  bool announces_once = false;  ///< a client that does not repeat its announcement
  std::optional<std::uint64_t> breaks_at;  ///< step from which a client answers with mistakes
  std::string announced_name;              ///< of a client that is another one's twin
  bool has_library = false;                ///< a client, unlike the others
  bool says_done = false;                  ///< a client that answers nevertheless
  bool is_wild = false;                    ///< a foreign client for which others may wait
  bool is_crowd = false;                   ///< a foreign client with very many participants
  bool resumes = false;  ///< a recorder that takes the place of a killed one goes on
  std::size_t queue = record::Arrivals::kMostEntries;  ///< of a recorder
  Instant delay{0};  ///< computing time of an answer; of the disk of a recorder
};

/// An option of a program that a plan can do without, in the words of a story.
struct Trait {
  bool PlannedProgram::*flag;
  const char* words;
};
inline constexpr std::array<Trait, 6> kTraits = {
    {{&PlannedProgram::follows_servers, "follows"},
     {&PlannedProgram::has_other_scenario, "other scenario"},
     {&PlannedProgram::is_sloppy, "sloppy"},
     {&PlannedProgram::is_early, "early"},
     {&PlannedProgram::announces_once, "announces once"},
     {&PlannedProgram::resumes, "resumes"}}};

/// The faults of a world after which a flight must be finished, and every program that is not
/// killed end with exit code 0.
enum class Promise {
  kNone,             ///< all kinds of faults
  kMild,             ///< short stops and cuts, some loss, slow processors, clocks
  kTakeOver,         ///< a client is killed in flight; another one is there
  kServerRestart,    ///< the server is killed in flight and started again; the others follow
  kRecorderRestart,  ///< a recorder is killed in flight and started again with --resume
  kCalm,             ///< no faults, a good network: no step is late either
  kReset,            ///< an operator resets the flight
  kPause,            ///< an operator pauses for longer than anybody may be absent
  kLongStop,         ///< a client is stopped for longer than it waits for a silent server, or the
                     ///< server twice, for less
  kTwoServers,       ///< a second server is started with the first
  kSuspend,  ///< all programs are stopped for the same time, or the server alone for less than
             ///< the others wait
};
const char* name_promise(Promise promise);

struct Plan {
  std::uint64_t seed = 0;
  std::size_t scenario = 0;
  std::size_t hosts = 1;
  std::vector<PlannedProgram> programs;
  Link link;  ///< between hosts; within one it is fast and loses nothing
  double drift = 0;
  double wall_offset_s = 0;
  bool has_files = false;             ///< recorders write real files
  std::size_t record_history = 5000;  ///< batches that a server keeps for late recorders
  Instant lease = Network::kLease;
  std::vector<Fault> faults;
  /// The faults are over: from now on all that can finish must.
  Instant healed{0};
  Promise promise = Promise::kNone;
};

/// The words of a file of faults that worlds understand.
config::faults::Abilities list_abilities();

/// `scenarios`: those to choose from. `cases`: likewise, of a file of faults; if there are some,
/// link and faults are those of the file, and the world makes no promise.
Plan draw_plan(std::uint64_t seed, const std::vector<FlownScenario>& scenarios,
               const std::vector<config::faults::Case>& cases = {});

/// One line for each program and fault.
std::vector<std::string> describe(const Plan& plan);
std::string describe(const Fault& fault);
std::string name_program(const Plan& plan, std::size_t index);

}  // namespace sls::worlds
