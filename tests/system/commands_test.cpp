/// Commands that the server must reject: an uninvited participant sends them during a real flight.
/// The flight must stay the same to the bit, and the server must count each rejection by its cause.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>

#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

/// An uninvited participant: reads the states and writes arbitrary commands to sls/command.
class Stranger {
 public:
  explicit Stranger(int domain)
      : node_(qos("default"), domain, "stranger"),
        servers_(node_),
        writer_(node_),
        reader_(node_, bus::kLoopReaderProfile, [this](const States& state, const bus::PeerId&) {
          const std::lock_guard lock(mutex_);
          last_ = state;
          seen_ = true;
        }) {}

  bool wait_for_state() {
    return wait_until([this] { return seen_.load() && !writer_.matched().empty(); });
  }

  States last_state() {
    const std::lock_guard lock(mutex_);
    return last_;
  }

  /// A valid command, for the caller to change.
  Commands make_command(std::uint64_t ahead) {
    const States state = last_state();
    Commands command;
    command.run_id(state.run_id());
    command.step(state.step() + ahead);
    command.vehicles().resize(1);
    command.vehicles()[0].f_Q_W_n({0.0, 0.0, -16.66});
    command.client_name("stranger");
    command.strength(1000);
    return command;
  }

  void write(const Commands& command) { writer_.write(command); }

  SyncCounters counters() {
    const auto status = servers_.find_status(last_state().run_id());
    return status ? status->counters() : SyncCounters();
  }

 private:
  bus::Node node_;
  bus::ServerDirectory servers_;
  bus::Writer<Commands> writer_;
  std::mutex mutex_;
  States last_;
  std::atomic<bool> seen_{false};
  bus::Reader<States> reader_;
};

TEST(CommandsTest, ABadCommandIsCountedByItsCauseAndNeverDisturbsTheFlight) {
  Flight undisturbed(scenario("mission"));
  Flight flight(scenario("mission"));
  Stranger stranger(flight.domain.number());
  ASSERT_TRUE(stranger.wait_for_state()) << flight.outputs();

  constexpr int kEach = 20;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kEach; ++i) {
    for (std::uint64_t ahead : {0, 1, 2}) {  // one is the awaited step on arrival
      Commands command = stranger.make_command(ahead);
      command.vehicles()[0].f_Q_W_n({nan, 0.0, 0.0});
      stranger.write(command);
      command.vehicles()[0].f_Q_W_n({0.0, infinity, 0.0});
      stranger.write(command);
      command.vehicles()[0].f_Q_W_n({0.0, 0.0, -1e6});
      stranger.write(command);
      command = stranger.make_command(ahead);
      command.vehicles()[0].fault(FaultCode::FAULT_FREE_FALL);
      command.vehicles()[0].mission(MissionPhase::MISSION_FAILED);
      stranger.write(command);
      command = stranger.make_command(ahead);
      command.run_id(command.run_id() + 1);
      stranger.write(command);
      command = stranger.make_command(ahead);
      command.vehicles()[0].vehicle_id(7);
      stranger.write(command);
      stranger.write(stranger.make_command(ahead));  // valid, apart from its sender
    }
    Commands command = stranger.make_command(1000000);
    stranger.write(command);
  }
  flight.expect_success();
  undisturbed.expect_success();
  EXPECT_TRUE(read_file(undisturbed.recording() / "state.csv") ==
              read_file(flight.recording() / "state.csv"));

  // The loop's readers are best effort: under load some commands may be lost, but not all.
  const Table status(flight.recording() / "status.csv");
  const std::size_t last = status.rows() - 1;
  const auto count = [&](const char* column) { return status.number(last, column); };
  for (const char* column : {"rejected_not_finite", "rejected_force_limit", "rejected_run",
                             "rejected_vehicle", "rejected_fault"}) {
    EXPECT_GT(count(column), 0) << column;
    EXPECT_LE(count(column), 6 * kEach) << column;
  }
  EXPECT_GT(count("rejected_step") + count("rejected_client"), 0);
  EXPECT_EQ(count("take_overs"), 0);
}

}  // namespace
}  // namespace sls::test
