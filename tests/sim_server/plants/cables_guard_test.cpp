/// The guard against a step that is too coarse, and tensions of steps with too many events.
#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <random>

#include "sim_server/plants/cables/keys.hpp"
#include "sim_server/plants/plant.hpp"
#include "tests/sim_server/plants/cables_flights.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim::cables {
namespace {

constexpr double kPeriod = 0.004;  // s
constexpr int kPeriods = 500;

/// A group that holds its places while noise shakes it. Loads of 3 g to 3 kg under vehicles of 50 g
/// to 3 kg: the lightest stand for what a coarse step cannot follow.
struct Group {
  explicit Group(std::uint64_t seed) : random(seed) {
    system.count = 1 + random() % 6;
    system.gravity = 9.8;
    system.restitution = random() % 2 == 0 ? 0.0 : draw(0.0, 0.8);
    system.load_mass = draw_scale(0.003, 3.0);
    system.is_rigid = random() % 2 == 0;
    const double size = system.is_rigid ? draw_scale(0.05, 0.5) : 0.0;
    if (system.is_rigid) {
      const Vector3d half = size * Vector3d(draw(0.2, 1.0), draw(0.2, 1.0), draw(0.2, 1.0));
      const Vector3d squares = half.cwiseAbs2();
      system.inertia_L =
          (system.load_mass / 3.0 * (Vector3d::Constant(squares.sum()) - squares)).asDiagonal();
      system.inverse_inertia_L = system.inertia_L.inverse();
    }
    start = make_motion();
    start.v_WL = draw_vector(1.0);
    if (system.is_rigid) start.w_WL_L = draw_vector(2.0);
    const double mass = draw_scale(0.05, 3.0);
    for (std::size_t i = 0; i < system.count; ++i) {
      system.vehicle_mass[i] = mass * draw(0.7, 1.3);
      system.attachment_L[i] = draw_vector(size);
      Vehicle& vehicle = start.vehicles[i];
      vehicle.length = draw_scale(0.2, 3.0);
      longest = std::max(longest, vehicle.length);
      const Vector3d n = (draw_vector(1.0) + Vector3d(0.0, 0.0, 1.2)).normalized();
      const double share = random() % 2 == 0 ? 1.0 : draw(0.5, 1.0);
      vehicle.p_W = system.attachment_L[i] - share * vehicle.length * n;
      vehicle.v_W = draw_vector(2.0);
      home[i] = vehicle.p_W + draw_vector(0.5);
    }
    frequency = draw(1.0, 5.0);
    for (Vectors& shake : shakes)
      for (Vector3d& acceleration : shake) acceleration = draw_vector(6.0);
  }

  double draw(double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) / 9007199254740992.0;
  }
  double draw_scale(double low, double high) {
    return low * std::exp(draw(0.0, std::log(high / low)));
  }
  Vector3d draw_vector(double scale) {
    return scale * Vector3d(draw(-1.0, 1.0), draw(-1.0, 1.0), draw(-1.0, 1.0));
  }

  std::mt19937_64 random;
  System system;
  Motion start;
  Vectors home;
  std::array<Vectors, 40> shakes;
  double frequency = 1.0, longest = 0.0;
};

struct Sample {
  Vectors places;  // of the vehicles, and last of the load
  bool is_named;   // until now, by the guard or for too many events in a step
};

std::vector<Sample> fly(const Group& group, double h) {
  const System& system = group.system;
  HybridMotion motion(system, group.start);
  std::vector<Sample> samples;
  std::vector<Event> events;
  Actions actions;
  bool is_named = false;
  const double share = system.load_mass / static_cast<double>(system.count);
  for (int period = 0; period < kPeriods; ++period) {
    const double w = group.frequency;
    for (std::size_t i = 0; i < system.count; ++i) {
      const Vehicle& vehicle = motion.motion().vehicles[i];
      const double mass = system.vehicle_mass[i];
      const Vector3d force = mass * (w * w * (group.home[i] - vehicle.p_W) - 1.4 * w * vehicle.v_W +
                                     group.shakes[period / 12 % 40][i]) -
                             Vector3d(0.0, 0.0, 9.8 * (mass + share));
      actions.f_Q_W[i] = std::min(1.0, 200.0 / force.norm()) * force;
    }
    for (int k = 0; k < std::lround(kPeriod / h); ++k) {
      events.clear();
      motion.step(actions, h, events);
      is_named |= motion.energy_error() > HybridMotion::kCoarse;
      for (const Event& event : events) is_named |= event.kind == Event::Kind::kStuck;
      for (std::size_t i = 0; i < system.count; ++i) EXPECT_GE(motion.tension()[i], -1e-9);
      if (!(motion.energy_error() <= HybridMotion::kWrong))
        return samples;  // here the plant ends the flight
    }
    Sample& sample = samples.emplace_back();
    sample.is_named = is_named;
    for (std::size_t i = 0; i < system.count; ++i)
      sample.places[i] = motion.motion().vehicles[i].p_W;
    sample.places[system.count] = motion.motion().p_WL;
  }
  return samples;
}

/// The first sample at which two flights are apart by 1 % of the longest cable, if one is.
const Sample* find_apart(const Group& group, const std::vector<Sample>& flown,
                         const std::vector<Sample>& other) {
  for (std::size_t k = 0; k < std::min(flown.size(), other.size()); ++k)
    for (std::size_t i = 0; i <= group.system.count; ++i)
      if (!((flown[k].places[i] - other[k].places[i]).norm() <= 0.01 * group.longest))
        return &flown[k];
  return nullptr;
}

TEST(CablesGuardTest, EveryFlightThatAQuarterOfTheStepMovesAwayIsNamedBefore) {
  const char* wanted = std::getenv("SLS_GROUPS");  // 4000 take two minutes
  const int count = wanted ? std::atoi(wanted) : 200;
  int named = 0, wrong = 0, ended = 0, chaotic = 0;
  for (int seed = 0; seed < count; ++seed) {
    const Group group(static_cast<std::uint64_t>(seed));
    const std::vector<Sample> flown = fly(group, 0.001);
    const bool is_ended = flown.size() < kPeriods;
    ended += is_ended;
    named += is_ended || flown.back().is_named;
    const Sample* apart = find_apart(group, flown, fly(group, 0.00025));
    if (!apart) continue;
    ++wrong;
    if (apart->is_named) continue;
    // Then the motion itself amplifies whatever happens: a start 10 µm away is as far away.
    Group moved = group;
    moved.start.p_WL.x() += 1e-5;
    EXPECT_TRUE(find_apart(group, flown, fly(moved, 0.001))) << "group " << seed;
    ++chaotic;
  }
  std::cout << count << " groups: " << named << " named, " << ended << " of them ended; " << wrong
            << " moved away, " << chaotic << " of them chaotic and not named\n";
  EXPECT_GT(wrong, chaotic) << "no group needed the guard";
}

/// Two vehicles of 1 kg pull a load of 2 g apart, whose cables of 1 m are almost a straight line:
/// it swings with (2 F / m_L l)^½, 141 rad/s for 20 N.
struct Pulled {
  explicit Pulled(double force_n, std::int64_t step_ns = 1'000'000)
      : forces{Vector3d(-force_n, 0.0, -9.8), Vector3d(force_n, 0.0, -9.8)} {
    scenario.plant.model.name = "cables";
    scenario.plant.step_ns = step_ns;
    scenario.vehicle = {1.0, 0.001, 1.0, 9.8};
    scenario.vehicles.resize(2);
    auto& cables = scenario.plant.own.edit<CablesKeys>().cables;
    cables.resize(2);
    cables[0].beta = 1.5;
    cables[1].beta = -1.5;
    plant = std::move(
        make_plants(find_plant_type(scenario.plant.model), scenario, {0, 1}).front().plant);
  }

  config::Scenario scenario;
  std::unique_ptr<Plant> plant;
  std::vector<Vector3d> forces;
};

TEST(CablesGuardTest, NamesTheStepThatWouldDoAndEndsAFlightThatIsWrong) {
  Pulled coarse(20.0);
  coarse.plant->advance(coarse.forces, 400);
  const std::vector<std::string> remarks = coarse.plant->take_remarks(0);
  ASSERT_EQ(remarks.size(), 3u);  // the first, and when half of what is named would no longer do
  EXPECT_EQ(
      remarks[0],
      "plant.step_s of 0.001 s too coarse for the motion at 0.014000000 s; 0.0005 s would do");
  EXPECT_NE(remarks[2].find("; 0.000125 s would do"), std::string::npos) << remarks[2];
  Pulled fine(20.0, 125'000);
  fine.plant->advance(fine.forces, 3200);
  EXPECT_TRUE(fine.plant->take_remarks(0).empty());
  Pulled wrong(100.0);
  EXPECT_EQ(
      test::find_error<std::runtime_error>([&] { wrong.plant->advance(wrong.forces, 400); }),
      "plant.step_s: expected at most 0.00003125 s for the motion at 0.312000000 s, got 0.001 s, "
      "with which the flight is wrong");
}

}  // namespace
}  // namespace sls::sim::cables
