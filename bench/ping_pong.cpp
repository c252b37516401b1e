#include "bench/ping_pong.hpp"

#include <slsPubSubTypes.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "bench/bare_endpoints.hpp"
#include "bench/latencies.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/wait.hpp"

namespace sls::bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr double kDiscoveryLimit_s = 20.0;
constexpr auto kResendTime = 100ms;  // best-effort readers may lose a sample

// --- the samples ---------------------------------------------------------------------------------

std::vector<States> make_states(std::uint32_t vehicles) {
  std::vector<States> samples;
  for (std::uint32_t id = 0; id < vehicles; ++id) {
    if (id % SAMPLE_VEHICLES == 0) samples.emplace_back().run_id(1);
    VehicleState& state = samples.back().vehicles().emplace_back();
    state.vehicle_id(id);
    state.force_origin(ForceOrigin::FORCE_ANSWERED);
    state.controller_name("control_client");
  }
  return samples;
}

Commands make_answer(const States& states) {
  Commands answer;
  answer.run_id(1);
  answer.client_name("control_client");
  for (const VehicleState& state : states.vehicles()) {
    ControlCommand& command = answer.vehicles().emplace_back();
    command.vehicle_id(state.vehicle_id());
    command.reference().stage_name("figure_eight");
  }
  return answer;
}

// --- the two ends --------------------------------------------------------------------------------

template <class Message, class Type>
struct Writer : BareWriter<Message, Type> {
  explicit Writer(BareNode& node)
      : BareWriter<Message, Type>(node, bus::Topic<Message>::kName, bus::kLoopWriterProfile) {}
};

template <class Message, class Type>
struct Reader : BareReader<Message, Type> {
  template <class Handler>
  Reader(BareNode& node, Handler handler)
      : BareReader<Message, Type>(node, bus::Topic<Message>::kName, bus::kLoopReaderProfile,
                                  handler) {}
};

class Ping {
 public:
  explicit Ping(const PingPongOptions& options)
      : options_(options),
        states_(make_states(options.vehicles)),
        node_(options.qos_file, options.domain, "server"),
        writer_(node_),
        reader_(node_, [this](const Commands& command) { receive(command); }) {
    latencies_.reserve(options.round_trips);
  }

  nlohmann::json run() {
    app::Wait wait(kDiscoveryLimit_s);
    while (writer_.count_matched() == 0 || reader_.count_matched() == 0) {
      check(wait);
      std::this_thread::sleep_for(1ms);
    }
    std::unique_lock lock(mutex_);
    send();
    while (!is_done()) {
      const auto step = step_;
      over_.wait_for(lock, kResendTime, [this] { return is_done(); });
      if (step != step_) continue;
      if (step_ == 0) check(wait);  // a time limit for discovery by both sides
      if (app::stop_signal() != 0) throw app::RunError("ping: interrupted");
      lost_ += step_ > 0 ? 1 : 0;
      send();
    }
    nlohmann::json json = latencies_.to_json();
    json["lost"] = lost_;
    return json;
  }

 private:
  static void check(const app::Wait& wait) {
    if (wait.is_over()) throw app::RunError("ping: nobody answers");
    if (app::stop_signal() != 0) throw app::RunError("ping: interrupted");
  }

  bool is_done() const { return step_ >= options_.warm_up + options_.round_trips; }

  void send() {
    answers_ = 0;
    sent_ = Clock::now();
    for (States& state : states_) {
      state.step(step_);
      writer_.write(state);
    }
  }

  /// Called on a thread of the middleware.
  void receive(const Commands& command) {
    const std::lock_guard lock(mutex_);
    if (command.step() != step_ || is_done() || ++answers_ < states_.size()) return;
    if (step_ >= options_.warm_up) latencies_.add(Clock::now() - sent_);
    ++step_;
    if (is_done())
      over_.notify_one();
    else
      send();
  }

  const PingPongOptions options_;
  std::vector<States> states_;
  std::mutex mutex_;  // guards step_ to latencies_
  std::uint64_t step_ = 0;
  std::size_t answers_ = 0;  // to this step
  Clock::time_point sent_;
  std::uint64_t lost_ = 0;
  Latencies latencies_;
  std::condition_variable over_;
  BareNode node_;
  Writer<States, StatesPubSubType> writer_;
  Reader<Commands, CommandsPubSubType> reader_;  // last: its callbacks use the members above
};

}  // namespace

nlohmann::json ping(const PingPongOptions& options) { return Ping(options).run(); }

void answer(const PingPongOptions& options) {
  BareNode node(options.qos_file, options.domain, "controller");
  Writer<Commands, CommandsPubSubType> writer(node);
  std::vector<Commands> answers;  // one for each state sample of a step
  for (const States& state : make_states(options.vehicles)) answers.push_back(make_answer(state));
  bool is_heard = false;  // before that no state is answered; the other side sends it again
  std::size_t next = 0;
  Reader<States, StatesPubSubType> reader(node, [&](const States& state) {
    is_heard = is_heard || writer.count_matched() > 0;
    if (!is_heard) return;
    answers[next].step(state.step());
    writer.write(answers[next]);
    next = (next + 1) % answers.size();
  });
  while (app::stop_signal() == 0) std::this_thread::sleep_for(20ms);
}

}  // namespace sls::bench
