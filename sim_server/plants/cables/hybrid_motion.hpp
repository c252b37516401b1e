/// The motion over time: fixed steps of fourth order, and what happens inside them. README.md,
/// "Integration", "Events" and "Ground".
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "sim_server/plants/cables/mechanics.hpp"

namespace sls::sim::cables {

struct Event {
  enum class Kind {
    kTaut,       ///< a cable reached its length
    kSlack,      ///< its tension would become negative, or the impact threw its ends together
    kStuck,      ///< too many events in one step: until its end, what touches stays
    kTouchDown,  ///< a body came to stand on the ground
    kLiftOff,    ///< it left the ground
  };
  Kind kind;
  std::size_t cable;  ///< or the body: a vehicle, or kLoad
  double time;        ///< since the start of the step, s
  double impulse;     ///< of the cable that became taut, N·s
};

class HybridMotion {
 public:
  /// Cables within `kLengthTolerance` of their length, whose ends do not approach, are taut. Bodies
  /// within it of the ground that do not rise stand on it.
  HybridMotion(const System& system, const Motion& start);

  /// Flies one step of `h` seconds. Appends what happened to `events`.
  /// @throws std::runtime_error if a cable would become shorter than the distance of a vehicle and
  ///   a load that both stand.
  void step(const Actions& actions, double h, std::vector<Event>& events);

  /// Between steps: the length of a cable (m) and its rate (m/s), with which the next step begins.
  void set_length(std::size_t cable, double length, double rate);
  /// Between steps: from now on the cable never pulls.
  void cut(std::size_t cable);
  /// Between steps: of all rotors, if the actions have a propulsion.
  RotorSpeeds& rotors() { return now().rotors; }
  const RotorSpeeds& rotors() const { return now().rotors; }
  bool is_cut(std::size_t cable) const { return !uncut_.has(cable); }

  const Motion& motion() const { return now().motion; }
  /// Those that pull, or just hold.
  Members taut() const { return mode_.get_pulling(); }
  /// Vehicles, and kLoad.
  const Members& standing() const { return mode_.standing; }
  /// Of the last step's actions, N; 0 of a slack cable and before the first step.
  const Vector& tension() const { return now().tension; }
  /// What the method itself gained or lost of the energy in about the last second, per energy that
  /// lifts the lightest body by the longest cable: README.md, eq. (18).
  double energy_error() const { return std::abs(energy_gain_); }

  static constexpr double kLengthTolerance = 1e-9;  ///< m
  /// Energy errors: above the first a flight may be wrong by 1 % of a cable, above the second it is
  /// wrong.
  static constexpr double kCoarse = 1e-5, kWrong = 1.0;

 private:
  using OfBodies = std::array<double, kMaxCables + 1>;

  /// The limits that hold now: cables at their length that pull, bodies on the ground.
  struct Mode {
    Members taut;       // that do not stretch
    Members stretched;  // those that do
    Members standing;
    Members get_pulling() const;
  };

  /// Forces of what holds: of the taut cables, and of the ground on standing bodies, upwards, N.
  struct Holding {
    Vector tension;
    OfBodies ground;
  };

  /// An instant, with what was computed for it.
  struct Instant : Holding {
    Motion motion;
    Geometry geometry;  ///< of all cables
    Factor factor;      ///< of the taut ones
    Motion rate;
    RotorSpeeds rotors;
    // Of the part of a step that ends here:
    double work;   // if it varies, J
    double drift;  // of a cable from its length, before eq. (8), m
  };

  /// A cable, whose limit is its length, or a body, whose limit is the ground.
  struct Limit {
    enum class Of { kNothing, kCable, kBody };
    Of of = Of::kNothing;
    std::size_t index = 0;
  };
  struct Found;

  Instant& now() { return ends_[now_at_]; }
  const Instant& now() const { return ends_[now_at_]; }
  Instant& then() { return ends_[1 - now_at_]; }  // the end of a step

  bool holds(const Limit& limit) const;
  double calc_excess(const Instant& instant, const Limit& limit) const;
  double calc_excess_rate(const Instant& instant, const Limit& limit) const;

  void set_standing(const Members& standing);
  void set_free(std::size_t body);
  void put_on_ground(const Members& bodies);
  Members find_touching(const Instant& instant) const;
  const Actions& act(const Actions& actions, const Instant& instant) const;
  void pull(const Actions& actions, Instant& instant) const;
  void support(const Actions& actions, Instant& instant) const;
  double place(const Members& cables, Instant& instant) const;
  double settle(const Members& cables, Instant& instant) const;
  void hold(const Members& cables, Instant& instant) const;
  double calc_lift(const Actions& actions, const Instant& instant, std::size_t body) const;
  void keep(const Actions& actions, const Members& cables);
  void solve(const Actions& actions, const Members& candidates);
  void choose(const Actions& actions, const Members& candidates);
  Vector hit(const Members& meeting);
  void integrate(const Actions& actions, double h, Instant& end);
  void note_energy_error(const Actions& actions);
  double calc_loss(const Actions& actions, const Instant& instant, const Limit& limit) const;
  std::optional<double> find_loss(const Actions& actions, double h, const Holding& middle,
                                  const Instant& end, const Limit& limit);
  std::optional<double> find_arrival(const Actions& actions, double h, const Instant& end,
                                     const Limit& limit);
  double calc_spring_stretch(const Instant& instant, std::size_t cable) const;
  std::optional<double> find_stretch(const Actions& actions, double h, const Instant& end,
                                     std::size_t cable);
  bool stretches(std::size_t cable) const { return system_.stiffness[cable] > 0.0; }
  Found find_first(const Actions& actions, double h);
  void meet(const Actions& actions, double time, const Limit& limit, std::vector<Event>& events);
  void let_go(const Actions& actions, double time, const Limit& limit, std::vector<Event>& events);
  void check_held() const;
  void report(const Mode& before, double time, std::vector<Event>& events) const;

  const System system_;
  System held_;                        // with the standing bodies infinitely heavy
  Members uncut_;                      // cables
  Members stiff_;                      // those that do not stretch
  const Members bodies_;               // that the ground stops; none without ground
  const double inverse_energy_scale_;  // 1/J
  double energy_gain_ = 0.0;           // of eq. (18)
  Mode mode_;
  Members united_;               // the pulling cables of a step, if some stretch
  std::array<Instant, 2> ends_;  // large: exchanged by their place
  std::size_t now_at_ = 0;
  Instant trial_, stage_;
  RotorSpeeds ending_;           // for the last stage of a step
  mutable Actions acting_;       // of the rotors at one instant; a member because it is large
  Holding between_;              // in the middle of the step last integrated
  bool does_work_vary_ = false;  // between the stages of a step: a force that is held gives f · Δx
  double force_scale_ = 0.0;     // of all forces, N
  bool is_later_ = false;        // not the first event of a step
  bool is_stuck_ = false;
};

}  // namespace sls::sim::cables
