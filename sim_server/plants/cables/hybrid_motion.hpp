/// The motion over time: fixed steps of fourth order, and what happens inside them. README.md,
/// "Integration" and "Events".
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "sim_server/plants/cables/mechanics.hpp"

namespace sls::sim::cables {

struct Event {
  enum class Kind {
    kTaut,   ///< a cable reached its length
    kSlack,  ///< its tension would become negative, or the impact threw its ends together
    kStuck,  ///< too many events in one step: until its end, taut cables stay taut
  };
  Kind kind;
  std::size_t cable;
  double time;     ///< since the start of the step, s
  double impulse;  ///< of the cable that became taut, N·s
};

class HybridMotion {
 public:
  /// Cables within `kLengthTolerance` of their length, whose ends do not approach, are taut.
  HybridMotion(const System& system, const Motion& start);

  /// Flies one step of `h` seconds. Appends what happened to `events`.
  void step(const Actions& actions, double h, std::vector<Event>& events);

  const Motion& motion() const { return now_.motion; }
  const Members& taut() const { return taut_; }
  /// Of the last step's actions, N; 0 of a slack cable and before the first step.
  const Vector& tension() const { return now_.tension; }

  static constexpr double kLengthTolerance = 1e-9;  ///< m

 private:
  /// An instant, with what was computed for it.
  struct Instant {
    Motion motion;
    Geometry geometry;  ///< of all cables
    Factor factor;      ///< of the taut ones
    Motion rate;
    Vector tension;
  };

  struct Found;

  Members find_touching(const Instant& instant) const;
  void pull(const Actions& actions, Instant& instant) const;
  void place(const Members& cables, Instant& instant) const;
  void settle(const Members& cables, Instant& instant) const;
  void hold(const Members& cables, Instant& instant) const;
  void keep_taut(const Actions& actions, const Members& cables);
  void choose_taut(const Actions& actions, const Members& candidates);
  void integrate(const Actions& actions, double h, Instant& end);
  double calc_violation(const Actions& actions, double time, std::size_t cable);
  std::optional<double> find_slack(const Actions& actions, double h, const Instant& end,
                                   std::size_t cable);
  std::optional<double> find_arrival(const Actions& actions, double h, const Instant& end,
                                     std::size_t cable);
  Found find_first(const Actions& actions, double h, const Instant& end);
  void meet(const Actions& actions, double time, std::size_t cable, std::vector<Event>& events);
  void slacken(const Actions& actions, double time, std::size_t cable, std::vector<Event>& events);
  void report(const Members& before, double time, std::vector<Event>& events) const;

  const System system_;
  const Members all_;
  Members taut_;
  Instant now_, then_, trial_, stage_;
  Vector tension_between_;    // in the middle of the step last integrated, N
  double force_scale_ = 0.0;  // of all forces, N
  bool is_stuck_ = false;
};

}  // namespace sls::sim::cables
