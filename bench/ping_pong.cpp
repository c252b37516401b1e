#include "bench/ping_pong.hpp"

#include <slsPubSubTypes.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
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

constexpr double kPatience_s = 20.0;  // for discovery
constexpr auto kResendTime = 100ms;   // best-effort readers may lose a sample

// --- the samples ---------------------------------------------------------------------------------

VehicleState make_state(std::uint32_t vehicle_id) {
  VehicleState state;
  state.run_id(1);
  state.vehicle_id(vehicle_id);
  state.force_origin(FORCE_ANSWERED);
  state.controller_name("control_client");
  return state;
}

ControlCommand make_command(std::uint32_t vehicle_id) {
  ControlCommand command;
  command.run_id(1);
  command.vehicle_id(vehicle_id);
  command.client_name("control_client");
  return command;
}

sls::Reference make_reference_of(std::uint32_t vehicle_id) {
  sls::Reference reference;
  reference.run_id(1);
  reference.vehicle_id(vehicle_id);
  reference.client_name("control_client");
  reference.stage_name("figure_eight");
  return reference;
}

struct Single {
  using State = VehicleState;
  using Command = ControlCommand;
  static std::vector<State> make_states(std::uint32_t) { return {make_state(0)}; }
  static Command make_answer(const State&) { return make_command(0); }
  using Reference = sls::Reference;
  static Reference make_reference(const State&) { return make_reference_of(0); }

  static constexpr const char* kWriterProfile = bus::kStreamWriterProfile;
  static constexpr const char* kReaderProfile = bus::kLoopReaderProfile;
};

struct Fleet {
  using State = FleetState;
  using Command = FleetCommand;
  static std::vector<State> make_states(std::uint32_t vehicles) {
    std::vector<State> samples;
    for (std::uint32_t id = 0; id < vehicles; ++id) {
      if (id % FLEET_SAMPLE_VEHICLES == 0) samples.emplace_back().run_id(1);
      samples.back().vehicles().push_back(make_state(id));
    }
    return samples;
  }
  static Command make_answer(const State& state) {
    Command command;
    command.run_id(1);
    for (const VehicleState& vehicle : state.vehicles())
      command.vehicles().push_back(make_command(vehicle.vehicle_id()));
    return command;
  }
  using Reference = FleetReference;
  static Reference make_reference(const State& state) {
    Reference reference;
    reference.run_id(1);
    for (const VehicleState& vehicle : state.vehicles())
      reference.vehicles().push_back(make_reference_of(vehicle.vehicle_id()));
    return reference;
  }

  static constexpr const char* kWriterProfile = bus::kFleetWriterProfile;
  static constexpr const char* kReaderProfile = bus::kFleetLoopReaderProfile;
};

// --- the ways to send them -----------------------------------------------------------------------

template <class Samples, class StateType, class CommandType, class ReferenceType>
struct Bare : Samples {
  using typename Samples::Command;
  using typename Samples::Reference;
  using typename Samples::State;
  struct Node : BareNode {
    Node(const PingPongOptions& options, const char* identity)
        : BareNode(options.qos_file, options.domain, identity) {}
  };
  template <class Message, class Type>
  struct Writer : BareWriter<Message, Type> {
    explicit Writer(Node& node)
        : BareWriter<Message, Type>(node, bus::Topic<Message>::kName, Samples::kWriterProfile) {}
  };
  template <class Message, class Type>
  struct Reader : BareReader<Message, Type> {
    template <class Handler>
    Reader(Node& node, Handler handler)
        : BareReader<Message, Type>(node, bus::Topic<Message>::kName, Samples::kReaderProfile,
                                    handler) {}
  };
  using StateWriter = Writer<State, StateType>;
  using CommandWriter = Writer<Command, CommandType>;
  using ReferenceWriter = Writer<Reference, ReferenceType>;
  using StateReader = Reader<State, StateType>;
  using CommandReader = Reader<Command, CommandType>;
};

template <class Message>
struct BusWriter : bus::Writer<Message> {
  using bus::Writer<Message>::Writer;
  std::size_t count_matched() const { return this->matched().size(); }
};

template <class Message>
struct BusReader : bus::Reader<Message> {
  template <class Handler>
  BusReader(bus::Node& node, Handler handler)
      : bus::Reader<Message>(
            node, bus::kLoopReaderProfile,
            [handler](const Message& message, const bus::PeerId&) { handler(message); }) {}
  std::size_t count_matched() const { return this->matched().size(); }
};

struct Bus : Single {
  struct Node : bus::Node {
    Node(const PingPongOptions& options, const char* identity)
        : bus::Node(options.qos_file, options.domain, "bench", identity) {}
  };
  using StateWriter = BusWriter<VehicleState>;
  using CommandWriter = BusWriter<ControlCommand>;
  using ReferenceWriter = BusWriter<sls::Reference>;
  using StateReader = BusReader<VehicleState>;
  using CommandReader = BusReader<ControlCommand>;
};

// --- the two ends --------------------------------------------------------------------------------

template <class Ends>
class Ping {
 public:
  explicit Ping(const PingPongOptions& options)
      : options_(options),
        states_(Ends::make_states(options.vehicles)),
        node_(options, "server"),
        writer_(node_),
        reader_(node_, [this](const typename Ends::Command& command) { receive(command); }) {
    latencies_.reserve(options.round_trips);
  }

  nlohmann::json run() {
    app::Wait wait(kPatience_s);
    const std::size_t readers = options_.is_overheard ? 2 : 1;
    while (writer_.count_matched() < readers || reader_.count_matched() == 0) {
      check(wait);
      std::this_thread::sleep_for(1ms);
    }
    std::unique_lock lock(mutex_);
    send();
    while (!is_done()) {
      const auto step = step_;
      over_.wait_for(lock, kResendTime, [this] { return is_done(); });
      if (step != step_) continue;
      if (step_ == 0) check(wait);  // until both sides have discovered each other
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
    for (auto& state : states_) {
      state.step(step_);
      writer_.write(state);
    }
  }

  /// On the middleware's thread.
  void receive(const typename Ends::Command& command) {
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
  std::vector<typename Ends::State> states_;
  std::mutex mutex_;  // over what follows
  std::uint64_t step_ = 0;
  std::size_t answers_ = 0;  // to this step
  Clock::time_point sent_;
  std::uint64_t lost_ = 0;
  Latencies latencies_;
  std::condition_variable over_;
  typename Ends::Node node_;
  typename Ends::StateWriter writer_;
  typename Ends::CommandReader reader_;  // last: its callbacks use the members above
};

template <class Ends>
void answer_with(const PingPongOptions& options) {
  typename Ends::Node node(options, "controller");
  typename Ends::CommandWriter writer(node);
  const auto states = Ends::make_states(options.vehicles);
  std::vector<typename Ends::Command> commands;  // one for each size of sample
  std::vector<typename Ends::Reference> references;
  for (const auto& state : states) {
    commands.push_back(Ends::make_answer(state));
    references.push_back(Ends::make_reference(state));
  }
  std::optional<typename Ends::ReferenceWriter> reference_writer;
  if (options.has_reference) reference_writer.emplace(node);
  const std::size_t overhearing = options.is_overheard ? 1 : 0;
  bool is_heard =
      false;  // by all who shall: until then nothing is answered, and the state comes again
  std::size_t next = 0;
  typename Ends::StateReader reader(node, [&](const typename Ends::State& state) {
    is_heard =
        is_heard || (writer.count_matched() >= 1 + overhearing &&
                     (!reference_writer || reference_writer->count_matched() >= overhearing));
    if (!is_heard) return;
    if (reference_writer) {
      references[next].step(state.step());
      reference_writer->write(references[next]);
    }
    commands[next].step(state.step());
    writer.write(commands[next]);
    next = (next + 1) % commands.size();
  });
  while (app::stop_signal() == 0) std::this_thread::sleep_for(20ms);
}

using BareSingle =
    Bare<Single, VehicleStatePubSubType, ControlCommandPubSubType, ReferencePubSubType>;
using BareFleet =
    Bare<Fleet, FleetStatePubSubType, FleetCommandPubSubType, FleetReferencePubSubType>;

/// Takes what a recorder takes, and forgets it.
template <class State, class Command, class Reference>
void overhear_with(const PingPongOptions& options, const char* profile) {
  bus::Node node(options.qos_file, options.domain, "bench", "recorder");
  const auto forget = [](const auto&, const bus::PeerId&) {};
  const bus::Reader<State> states(node, profile, forget);
  const bus::Reader<Command> commands(node, profile, forget);
  const bus::Reader<Reference> references(node, profile, forget);
  while (app::stop_signal() == 0) std::this_thread::sleep_for(20ms);
}

}  // namespace

nlohmann::json ping(const PingPongOptions& options) {
  if (options.vehicles > 1) return Ping<BareFleet>(options).run();
  return options.uses_bus ? Ping<Bus>(options).run() : Ping<BareSingle>(options).run();
}

void overhear(const PingPongOptions& options) {
  if (options.vehicles > 1)
    overhear_with<FleetState, FleetCommand, FleetReference>(options,
                                                            bus::kFleetRecorderReaderProfile);
  else
    overhear_with<VehicleState, ControlCommand, Reference>(options, bus::kRecorderReaderProfile);
}

void answer(const PingPongOptions& options) {
  if (options.vehicles > 1) return answer_with<BareFleet>(options);
  options.uses_bus ? answer_with<Bus>(options) : answer_with<BareSingle>(options);
}

}  // namespace sls::bench
