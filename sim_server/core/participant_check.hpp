/// Mistakes of the participants of a run, in words: sim_server/README.md, "What a participant does
/// wrong". No network and no clock here.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"
#include "common/sync/membership.hpp"
#include "sim_server/core/command_gate.hpp"

namespace sls::sim {

/// The participants and endpoints that the server has discovered at one moment.
struct Neighbourhood {
  std::chrono::steady_clock::time_point now;
  std::vector<sync::Member> participants;  ///< of any run
  std::set<std::uint64_t> other_runs;      ///< runs of other servers
  std::set<std::uint32_t> other_vehicles;  ///< vehicles of other servers
  /// On a network packets are lost, and discovery needs longer.
  bool is_on_network = false;
  /// Participants with a matched writer of sls/command, as text.
  std::map<bus::PeerId, std::string> command_writers;
  /// Participants with a matched writer of sls/participant: an announcement may still come.
  std::set<bus::PeerId> announcement_writers;
  std::set<bus::PeerId> state_readers;  ///< participants with a matched reader of sls/state
  /// Participants that have acknowledged the parameters and a status of this run.
  std::set<bus::PeerId> informed;
  /// Participants whose commands carry a source timestamp in the future: how far ahead of our
  /// clock, s.
  std::map<bus::PeerId, double> stamps_ahead_s;
  /// Controllers whose writer offers no DEADLINE (bus::Node::find_missing_deadlines).
  std::map<bus::PeerId, std::string> missing_deadlines;
  /// Participants with another problem in discovery, which explains why no announcement comes.
  std::set<bus::PeerId> explained;
};

class ParticipantCheck {
 public:
  using Clock = std::chrono::steady_clock;
  using Entry = sync::Member;
  /// Current problems by key. A problem keeps its key while it lasts.
  using Findings = std::map<std::string, std::string>;

  /// A shorter problem is ignored, because discovery takes time.
  static constexpr std::chrono::milliseconds kPatience{1000};
  /// The same on a network that may lose packets: Fast DDS repeats lost discovery data once a
  /// second. With 20 % loss one in a hundred participants needs 8 to 10 s.
  static constexpr std::chrono::milliseconds kPatienceOnNetwork{15000};
  /// Patience with an announcement: on a network of a client without a writer for it, on this
  /// machine of one that has not acknowledged parameters and status. A busy machine loses
  /// datagrams, too.
  static constexpr std::chrono::milliseconds kPatienceWithLoss{4000};
  /// The same if only an announcement can still be lost, which is repeated ten times a second.
  static constexpr std::chrono::milliseconds kPatienceWithInformed{2500};
  /// Patience with an announcement of a run that has just ended: its client joins the next run.
  static constexpr std::chrono::milliseconds kPatienceWithRun{1400};
  /// Patience with rejected answers while none is taken.
  static constexpr std::chrono::milliseconds kPatienceWithAnswers{800};
  /// A problem of answers lasts this long after the last answer that shows it.
  static constexpr std::chrono::milliseconds kMemory{2000};
  static constexpr std::size_t kMostSenders = 64;
  /// More copies of each answer are a flood. States that are sent again cause some.
  static constexpr std::uint64_t kMostCopies = 30;
  /// Largest distance of load and quadrotor from the reference, in rod lengths.
  static constexpr double kMostRodLengths = 50.0;

  ParticipantCheck(std::uint64_t run_id, const config::Scenario& scenario,
                   const std::vector<std::uint32_t>& vehicle_ids);

  /// The entries (of this run) that may take part: they use this contract, and a controller has
  /// loaded the library with which its vehicles are flown.
  std::vector<Entry> admit_controllers(const std::vector<Entry>& entries);
  static std::vector<Entry> admit_recorders(const std::vector<Entry>& entries);

  /// The answer of `sender` was accepted, held, late, a copy or superseded. `returned` is the
  /// controller state in the state sample of the step in work; `state` is the state of the vehicle
  /// at that step.
  void note_taken(const OfferedAnswer& offered, const bus::PeerId& sender, Verdict verdict,
                  const model::ControllerMemory& returned, const model::Measurement& state);
  /// Answers of both clients to one step arrived; that of `winner` was taken.
  void note_superseded(const bus::PeerId& loser, const bus::PeerId& winner) {
    superseded_.emplace(loser, winner);
  }
  /// The answer of `sender` was rejected while `step` was in work.
  void note_rejected(const OfferedAnswer& offered, const bus::PeerId& sender, Verdict verdict,
                     std::uint64_t step);

  /// A sample of `sender` for this run and `step` answers no vehicle.
  void note_empty(const bus::PeerId& sender, std::uint64_t step);

  /// All current problems. Call a few times a second.
  Findings look(const Neighbourhood& neighbourhood);

  /// " (57 of its answers rejected, none taken: …)", for messages about an awaited client; empty if
  /// its last answer was taken.
  std::string describe_rejections(const bus::PeerId& sender) const;

  /// When `look` is due again, because a pending problem will then have lasted too long.
  const std::optional<Clock::time_point>& next_due() const { return next_due_; }

  /// Events since the last call, such as a vehicle far from its reference.
  std::vector<std::string> take_events();

 private:
  struct Rejections {
    std::uint64_t count = 0;
    std::string defect;  // of the last rejected answer
    bool is_old = true;  // all were answers to earlier steps
    std::optional<Clock::time_point> since;
  };
  /// The answers of a client that were not rejected.
  struct Answers {
    std::string client_name;   // in the last one
    std::uint64_t steps = 0;   // since the last look, times vehicles
    std::uint64_t copies = 0;  // since the last look
  };
  /// A mistake in answers.
  struct Seen {
    std::string text;  // without the sender
    bool is_fresh = true;
    Clock::time_point last;
  };
  struct Library {
    std::string sha256;
    std::string name;  // of the client that has loaded it
  };
  struct Vehicle {
    std::uint32_t id = 0;
    double rod_length = 0.0;
    std::vector<std::optional<std::int64_t>> stages_ns;  // durations; nothing if not fixed
    std::vector<std::string> stage_names;
    std::uint32_t stage = 0;             // in the last accepted answer
    std::uint64_t stage_start_step = 0;  // of the first answer with that stage
    bool is_stage_lost = false;          // an answer was behind the state's stage
    std::size_t numbers = 0;             // largest count in an answer so far
    std::string stage_name;              // in the last accepted answer
    bool is_stage_name_text = true;
    bool is_far = false;
    bool has_flown = false;
    // Of the client that flies or, before that, of the first one that is ready and not gone.
    std::optional<Library> library;
  };
  using Senders = std::map<bus::PeerId, const Entry*>;

  void find_first_libraries(const std::vector<Entry>& controllers);
  /// The library that `controller` should have loaded; null if it has loaded the right one.
  const Library* find_other_library(const Participant& controller) const;

  void count(const OfferedAnswer& offered, const bus::PeerId& sender, Verdict verdict);
  void check_stage_name(Vehicle& vehicle, const OfferedAnswer& offered, const bus::PeerId& sender);
  void check_memory(Vehicle& vehicle, const OfferedAnswer& offered, const bus::PeerId& sender,
                    const model::ControllerMemory& returned);
  void check_stage(Vehicle& vehicle, const OfferedAnswer& offered, const bus::PeerId& sender);
  void check_distance(Vehicle& vehicle, const OfferedAnswer& offered,
                      const model::Measurement& state);
  template <class MakeText>
  void see(const bus::PeerId& sender, const char* what, MakeText make_text);
  static std::string describe_early(std::uint64_t got, std::uint64_t unpublished);
  std::string describe_defect(const OfferedAnswer& offered, Verdict verdict,
                              std::uint64_t step) const;

  void look_at(const Entry& entry, const Neighbourhood& neighbourhood, Findings& findings);
  void look_at_role(const Entry& entry, const Neighbourhood& neighbourhood, Findings& findings);
  void look_at_readiness(const Entry& entry, const Neighbourhood& neighbourhood,
                         Findings& findings);
  void look_at_valid_answers(const Neighbourhood& neighbourhood, const Senders& announced,
                             Findings& findings);
  bool may_fly_for_us(const Participant& controller, const Neighbourhood& neighbourhood) const;
  std::optional<std::string> find_wrong_vehicles(const Participant& announcement,
                                                 const Neighbourhood& neighbourhood) const;
  /// Reports clients of one name and strength that fly the same vehicle.
  void look_for_twins(const Neighbourhood& neighbourhood, Findings& findings);
  bool flies(const Participant& controller) const;
  void look_at_strangers(const Neighbourhood& neighbourhood, const Senders& announced,
                         Findings& findings);
  void look_at_answers(const Neighbourhood& neighbourhood, const Senders& announced,
                       Findings& findings);
  /// True if the problem `key` has lasted for `patience` without a break.
  bool lasts(const std::string& key, Clock::time_point now, Clock::duration patience);
  /// The same with the patience that the network needs. `is_informed`: the participant has
  /// discovered all of us and has the parameters, so it could know better.
  bool lasts_despite_losses(const std::string& key, const Neighbourhood& neighbourhood,
                            bool is_informed = false);
  bool is_own_vehicle(std::uint32_t id) const;

  const std::uint64_t run_id_;
  const std::string scenario_sha256_;
  const std::vector<std::uint32_t> vehicle_ids_;
  const std::int64_t period_ns_;
  std::vector<Vehicle> vehicles_;                         // as vehicle_ids_
  std::map<bus::PeerId, std::string> refused_libraries_;  // of clients that are not admitted
  std::map<bus::PeerId, Rejections> rejections_;
  std::map<bus::PeerId, Answers> answers_;
  std::map<std::pair<bus::PeerId, std::string>, Seen> seen_;
  using Pair = std::pair<bus::PeerId, bus::PeerId>;
  std::optional<Pair> superseded_;                    // since the last look
  std::map<Pair, Clock::time_point> rivals_;          // pairs that answered the same step; when
  std::map<std::string, Clock::time_point> pending_;  // start of each problem
  std::set<std::string> pending_now_;
  std::optional<Clock::time_point> next_due_;
  std::vector<std::string> events_;
};

}  // namespace sls::sim
