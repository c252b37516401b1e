// The threads around the core: answers and requests from several threads while runs are paused,
// stepped and reset. Worlds do not try locks, wake-ups and the end of threads; this does.
#include "sim_server/core_loop.hpp"

#include <gtest/gtest.h>

#include <random>
#include <thread>
#include <vector>

#include "tests/sim_server/core/server_rig.hpp"
#include "tests/support/waiting.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

#ifdef SLS_TSAN  // an event takes twenty times as long
constexpr std::uint64_t kEvents = 200'000;
#else
constexpr std::uint64_t kEvents = 1'000'000;
#endif

/// Counts what leaves; the main thread writes status and replies.
class Shell : public Outputs, public Surroundings, public Backlog {
 public:
  std::atomic<std::uint64_t> run_id{1};
  std::atomic<std::uint64_t> step{0};
  std::uint64_t first_gap = 0;  // the first state that did not follow the one before
  std::uint64_t unrecorded = 0;
  std::atomic<std::uint64_t> replies{0};
  std::atomic<std::uint64_t> resent{0};

  // Outputs: under the lock of the core
  Moment send_states(const Fleet& fleet) override {
    const bool follows = fleet.step() == 0 || fleet.step() == step + 1;
    if (!follows && first_gap == 0) first_gap = fleet.step();
    if (fleet.step() != recorded_end_) ++unrecorded;
    step = fleet.step();
    return {std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
  }
  void resend_states(const Fleet&, const std::function<bool(std::size_t)>&) override { ++resent; }
  void record_step(const Fleet& fleet) override { recorded_end_ = fleet.step() + 1; }
  void record_late(const Vehicle&, const OfferedAnswer&) override {}
  bool is_record_full() const override { return false; }
  std::uint64_t lost() const override { return 0; }
  void flush_records() override {}
  void end_records() override { recorded_end_ = 0; }
  void send(const SimStatus&) override { ++waiting_; }
  void send(const SimControlReply&) override {
    ++waiting_;
    ++waiting_replies_;
  }
  void log(sync::Line) override { ++waiting_; }
  void show_progress(std::string) override {}
  void begin_flight() override {}
  void ignore_lifespan(bool) override {}

  // Backlog: on the main thread
  bool is_waiting() const override { return waiting_ > 0; }
  void write_waiting() override {
    waiting_ = 0;
    replies += waiting_replies_.exchange(0);
  }

  // Surroundings: on the main thread, but the version
  std::uint64_t members_version() const override { return version; }
  std::vector<sync::Member> find_members(ParticipantRole role, std::uint64_t id) const override {
    if (role != ParticipantRole::ROLE_CONTROLLER) return {};
    sync::Member member;
    member.announcement.role(role);
    member.announcement.run_id(id);
    member.announcement.name("pilot");
    member.announcement.contract_sha256(bus::kContractSha256);
    member.announcement.scenario_sha256(scenario.sha256);
    member.announcement.vehicle_ids({0});
    member.announcement.ready(true);
    member.heard = std::chrono::steady_clock::now();
    return {member};
  }
  std::vector<sync::Run> find_other_runs() const override { return {}; }
  bool is_known_elsewhere(std::uint64_t) const override { return false; }
  bool stays_on_this_machine() const override { return true; }
  bool has_heard_every_claim() const override { return true; }
  std::uint64_t problems_version() const override { return 0; }
  Neighbourhood find_neighbours() override { return {}; }
  std::string replace_problems(const std::map<std::string, std::string>&) override { return ""; }
  std::string describe_isolation() const override { return ""; }
  Queues queues() const override { return {0, 10'000, 0}; }
  std::optional<std::chrono::nanoseconds> command_lifespan() const override { return {}; }
  std::string stop_signal() const override { return ""; }

  const config::Scenario scenario = [] {
    auto made = ServerRig::make_scenario();
    made.plant.model.name = "analytic";
    std::get<config::LeaveAfter>(made.mission.front().leave).duration_ns = 1'000'000'000'000'000;
    return made;
  }();
  std::atomic<std::uint64_t> version{1};

 private:
  std::uint64_t recorded_end_ = 0;
  std::atomic<int> waiting_{0};
  std::atomic<std::uint64_t> waiting_replies_{0};
};

SimControl make_request(std::uint64_t run_id, std::uint64_t id, ControlAction action) {
  SimControl request;
  request.run_id(run_id);
  request.request_id(id);
  request.operator_name("anna@box");
  request.action(action);
  request.steps(20);
  return request;
}

/// The client's answer to the last state.
void answer(CoreLoop& loop, const Shell& shell) {
  loop.put([&](CommandSample& sample) {
    sample.arrived = {std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
    sample.written = sample.arrived.wall;
    sample.run_id = shell.run_id;
    sample.step = shell.step;
    sample.answers.resize(1);
    OfferedAnswer& offered = sample.answers[0];
    offered.run_id = sample.run_id;
    offered.step = sample.step;
    offered.client_name = "pilot";
    offered.answer.f_Q_W = {0.0, 0.0, -16.66};
  });
}

std::unique_ptr<Fleet> make_fleet(const Shell& shell) {
  return std::make_unique<Fleet>(shell.scenario, std::vector<std::uint32_t>{0}, shell.run_id,
                                 [](std::size_t count, const auto& work) {
                                   for (std::size_t i = 0; i < count; ++i) work(i);
                                 });
}

TEST(CoreLoopTest, ManyEventsOfFourThreadsLoseNothingAndKeepTheOrder) {
  Shell shell;
  CoreLoop loop(true, shell, shell);
  std::atomic<bool> is_over{false};
  std::atomic<std::uint64_t> events{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i)
    threads.emplace_back([&] {
      for (std::uint64_t answered = 0, copies = 0; !is_over;) {
        // Mostly the first answer to a state, and a copy every few rounds.
        if (answered == shell.step + 1 && ++copies % 16 != 0) {
          std::this_thread::yield();
          continue;
        }
        answered = shell.step + 1;
        answer(loop, shell);
        ++events;
      }
    });
  std::uint64_t requests = 0;
  threads.emplace_back([&] {
    std::mt19937 random(1);
    while (!is_over) {
      static constexpr ControlAction kActions[] = {
          ControlAction::ACTION_PAUSE, ControlAction::ACTION_STEP, ControlAction::ACTION_RESUME,
          ControlAction::ACTION_RESUME};
      const bool is_reset = random() % 50 == 0;
      loop.put(make_request(shell.run_id, ++requests,
                            is_reset ? ControlAction::ACTION_RESET : kActions[random() % 4]));
      if (random() % 8 == 0) ++shell.version;
      ++events;
      std::this_thread::sleep_for(200us);
    }
  });
  std::uint64_t runs = 0, steps = 0;
  while (events < kEvents) {
    ServerCore core(shell.scenario, {shell.run_id, false, false}, make_fleet(shell), shell,
                    std::chrono::steady_clock::now());
    loop.run(core);
    ASSERT_EQ(core.end(), ServerCore::End::kReset) << core.error();
    ++runs;
    steps += shell.step;
    ++shell.run_id;
  }
  is_over = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(shell.first_gap, 0u);
  EXPECT_EQ(shell.unrecorded, 0u);
  EXPECT_GT(runs, 3u);
  EXPECT_GT(steps, 100u);
  EXPECT_GT(shell.replies, runs) << "of " << requests << " requests";
}

TEST(CoreLoopTest, TheMainThreadSleepsLongerTheLongerAnswersCame) {
  EXPECT_EQ(CoreLoop::calc_slack(0ms), 0ms);
  EXPECT_EQ(CoreLoop::calc_slack(32ms), 1ms);
  EXPECT_EQ(CoreLoop::calc_slack(320ms), 10ms);
  EXPECT_EQ(CoreLoop::calc_slack(1h), 10ms);
}

TEST(CoreLoopTest, AStateIsSentAgainAlsoWhereTheMainThreadSleepsLonger) {
  Shell shell;
  CoreLoop loop(true, shell, shell);
  bool is_resent = false;
  std::thread client([&] {
    const auto limit = std::chrono::steady_clock::now() + 30s;
    auto end = limit;  // half a second after the first step
    std::uint64_t answered = 0, resent = 0;
    while (std::chrono::steady_clock::now() < end) {
      if (end == limit && shell.step > 0) end = std::chrono::steady_clock::now() + 500ms;
      if (answered == shell.step + 1 && resent == shell.resent) {
        std::this_thread::yield();
        continue;
      }
      resent = shell.resent;
      answered = shell.step + 1;
      answer(loop, shell);
    }
    const std::uint64_t before = shell.resent;
    is_resent = test::wait_until([&] { return shell.resent > before; });
    loop.put(make_request(shell.run_id, 1, ControlAction::ACTION_STOP));
  });
  ServerCore core(shell.scenario, {shell.run_id, false, false}, make_fleet(shell), shell,
                  std::chrono::steady_clock::now());
  loop.run(core);
  client.join();
  EXPECT_GT(shell.step, 0u);
  EXPECT_TRUE(is_resent);
}

}  // namespace
}  // namespace sls::sim
