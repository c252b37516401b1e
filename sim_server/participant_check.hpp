/// Mistakes of the participants of a run, in words: README.md, "What a participant does wrong".
/// No network and no clock here.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"
#include "sim_server/command_gate.hpp"

namespace sls::sim {

/// Everybody that the server sees at one moment.
struct Neighbourhood {
  std::chrono::steady_clock::time_point now;
  std::vector<bus::ParticipantDirectory::Entry> participants;  ///< whatever their run
  std::set<std::uint64_t> other_runs;                          ///< those of other servers
  std::set<std::uint32_t> other_vehicles;                      ///< and what they fly
  /// Participants with a writer of sls/command that matches, in words.
  std::map<bus::PeerId, std::string> command_writers;
  /// Those with a writer of sls/participant: an announcement may be on its way.
  std::set<bus::PeerId> announcement_writers;
  /// Controllers whose writer offers no DEADLINE (bus::Node::find_missing_deadlines).
  std::map<bus::PeerId, std::string> missing_deadlines;
  /// Those with another problem in discovery: their silence has been explained.
  std::set<bus::PeerId> explained;
};

class ParticipantCheck {
 public:
  using Clock = std::chrono::steady_clock;
  using Entry = bus::ParticipantDirectory::Entry;
  /// Problems that hold, by a key that stays the same while one does.
  using Findings = std::map<std::string, std::string>;

  /// A problem that is shorter is ignored: discovery takes its time.
  static constexpr std::chrono::milliseconds kPatience{1000};
  /// An announcement on a lossy network: a peer learns of a reader from discovery, which Fast DDS
  /// repeats once a second.
  static constexpr std::chrono::milliseconds kPatienceWithAnnouncement{5000};
  /// An announcement of a run that has just ended is none: its client joins the next one.
  static constexpr std::chrono::milliseconds kPatienceWithRun{1400};
  /// Rejected answers without a taken one are none before.
  static constexpr std::chrono::milliseconds kPatienceWithAnswers{800};
  /// A problem seen in an answer holds so long after the last answer like it.
  static constexpr std::chrono::milliseconds kMemory{2000};
  static constexpr std::size_t kMostSenders = 64;
  /// Load and quadrotor may be so many rod lengths from their reference.
  static constexpr double kMostRodLengths = 50.0;

  ParticipantCheck(std::uint64_t run_id, const config::Scenario& scenario,
                   const std::vector<std::uint32_t>& vehicle_ids);

  /// Those of `entries` (of this run) that may take part: they use this contract, and controllers
  /// have loaded the library with which their vehicles are flown.
  std::vector<Entry> admit_controllers(const std::vector<Entry>& entries);
  static std::vector<Entry> admit_recorders(const std::vector<Entry>& entries);

  /// The answer of `sender` was accepted, held, late, a copy or superseded. `returned` is the
  /// controller state that the state of its step carried, where the step is in work; `state` what
  /// the vehicle does there.
  void note_taken(const OfferedAnswer& answer, const bus::PeerId& sender, Verdict verdict,
                  const ControllerState& returned, const model::Measurement& state);
  /// It was rejected while `step` was in work.
  void note_rejected(const OfferedAnswer& answer, const bus::PeerId& sender, Verdict verdict,
                     std::uint64_t step);

  /// All that is wrong now. To be called a few times a second.
  Findings look(const Neighbourhood& neighbourhood);

  /// " (its answers are rejected: 57 × …)", for messages about an awaited client; empty if the last
  /// one was taken.
  std::string describe_rejections(const bus::PeerId& sender) const;

  /// When to look again, because something will then have lasted too long.
  const std::optional<Clock::time_point>& next_due() const { return next_due_; }

  /// News to announce since the last call, such as a vehicle far from its reference.
  std::vector<std::string> take_events();

 private:
  struct Rejections {
    std::uint64_t count = 0;
    std::string defect;  // the last one
    bool is_old = true;  // all answered steps that had gone by
    std::optional<Clock::time_point> since;
  };
  /// Something seen in answers.
  struct Seen {
    std::string text;  // without who it was
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
    std::vector<std::optional<std::int64_t>> stages_ns;  // how long each lasts, where that is fixed
    std::vector<std::string> stage_names;
    std::uint32_t stage = 0;             // in the last accepted answer
    std::uint64_t stage_start_step = 0;  // the first that said so
    bool is_stage_lost = false;          // it fell behind what the state said
    std::size_t numbers = 0;             // the most that an accepted answer carried
    bool is_far = false;
    bool has_flown = false;
    std::optional<Library> library;  // of the client that flies it or, before, was ready first
  };
  using Senders = std::map<bus::PeerId, const Entry*>;

  void find_first_libraries(const std::vector<Entry>& controllers);
  /// The one that it should have loaded; nothing if all is well.
  const Library* find_other_library(const Participant& controller) const;

  void check_memory(Vehicle& vehicle, const OfferedAnswer& answer, const bus::PeerId& sender,
                    const ControllerState& returned);
  void check_stage(Vehicle& vehicle, const OfferedAnswer& answer, const bus::PeerId& sender);
  void check_distance(Vehicle& vehicle, const OfferedAnswer& answer,
                      const model::Measurement& state);
  template <class MakeText>
  void see(const bus::PeerId& sender, const char* what, MakeText make_text);
  static std::string describe_early(std::uint64_t got, std::uint64_t unpublished);
  std::string describe_defect(const OfferedAnswer& answer, Verdict verdict,
                              std::uint64_t step) const;

  void look_at(const Entry& entry, const Neighbourhood& neighbourhood, Findings& findings);
  bool may_fly_for_us(const Participant& controller, const Neighbourhood& neighbourhood) const;
  std::optional<std::string> find_wrong_vehicles(const Participant& announcement,
                                                 const Neighbourhood& neighbourhood) const;
  void look_at_strangers(const Neighbourhood& neighbourhood, const Senders& announced,
                         Findings& findings);
  void look_at_answers(const Neighbourhood& neighbourhood, const Senders& announced,
                       Findings& findings);
  /// Whether `key` has held for `patience` without a break.
  bool lasts(const std::string& key, Clock::time_point now, Clock::duration patience);
  bool is_own_vehicle(std::uint32_t id) const;

  const std::uint64_t run_id_;
  const std::string scenario_sha256_;
  const std::vector<std::uint32_t> vehicle_ids_;
  const std::int64_t period_ns_;
  std::vector<Vehicle> vehicles_;                         // as vehicle_ids_
  std::map<bus::PeerId, std::string> refused_libraries_;  // of those who are not admitted
  std::map<bus::PeerId, Rejections> rejections_;
  std::map<std::pair<bus::PeerId, std::string>, Seen> seen_;
  std::map<std::string, Clock::time_point> pending_;  // since when
  std::set<std::string> pending_now_;
  std::optional<Clock::time_point> next_due_;
  std::vector<std::string> events_;
};

}  // namespace sls::sim
