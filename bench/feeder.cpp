#include "bench/feeder.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "closed_loop/samples.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/wait.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "sim_server/roster.hpp"

namespace sls::bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kRunId = 1;
constexpr double kPatience_s = 60.0;
constexpr auto kAnnounceTime = 500ms;
constexpr std::size_t kRowsOfStep = 4;

/// What the participants of the run announce, and what the recorder does.
class Surroundings {
 public:
  Surroundings(bus::Node& node, const config::Scenario& scenario, std::uint32_t vehicles)
      : participants_(node), parameters_(node), statuses_(node), announcements_(node) {
    controller_.run_id(kRunId);
    for (std::uint32_t id = 0; id < vehicles; ++id) controller_.vehicle_ids().push_back(id);
    controller_.role(ROLE_CONTROLLER);
    controller_.name("control_client");
    controller_.host(bus::host_name());
    controller_.scenario_sha256(scenario.sha256);
    controller_.ready(true);
    parameters_.write(closed_loop::make_parameters(scenario, kRunId, vehicles));
    announce(PHASE_WAITING, 0);
  }

  void announce(RunPhase phase, std::uint64_t step) {
    statuses_.write(closed_loop::make_status(kRunId, index_++, phase, step));
    announcements_.write(controller_);
    announced_ = Clock::now();
  }

  /// Returns when `is_over` holds of what the recorder announced last, and keeps the run alive.
  void wait(RunPhase phase, std::uint64_t step, const char* what,
            const std::function<bool(const Participant&)>& is_over) {
    const app::Wait wait(kPatience_s);
    while (true) {
      if (participants_.version() != version_) {
        version_ = participants_.version();
        recorders_ = participants_.find(ROLE_RECORDER, kRunId);
      }
      if (!recorders_.empty() && is_over(recorders_.front().announcement)) return;
      if (app::stop_signal() != 0) throw app::RunError("feeder: interrupted");
      if (wait.is_over()) throw app::RunError(std::string("feeder: waited for ") + what);
      announce_if_due(phase, step);
      std::this_thread::sleep_for(1ms);
    }
  }

  void announce_if_due(RunPhase phase, std::uint64_t step) {
    if (Clock::now() - announced_ > kAnnounceTime) announce(phase, step);
  }

 private:
  bus::ParticipantDirectory participants_;
  bus::Writer<Parameters> parameters_;
  bus::Writer<SimStatus> statuses_;
  bus::Writer<Participant> announcements_;
  Participant controller_;
  std::uint64_t index_ = 0;
  Clock::time_point announced_;
  std::uint64_t version_ = 0;
  std::vector<bus::ParticipantDirectory::Entry> recorders_;
};

/// The stream of one vehicle.
class SingleStream {
 public:
  SingleStream(bus::Node& node, std::uint32_t)
      : states_(node), references_(node), commands_(node) {}
  void write(const closed_loop::StepSamples& step) {
    states_.write(step.state);
    references_.write(step.reference);
    commands_.write(step.command);
  }
  int history_depth() const { return states_.history_depth(); }

 private:
  bus::Writer<VehicleState> states_;
  bus::Writer<Reference> references_;
  bus::Writer<ControlCommand> commands_;
};

/// A fleet's, every vehicle of which flies the same.
class FleetStream {
 public:
  FleetStream(bus::Node& node, std::uint32_t vehicles)
      : vehicles_(vehicles), states_(node), references_(node), commands_(node) {}
  void write(const closed_loop::StepSamples& step) {
    write_all(states_, state_, step.state);
    write_all(references_, reference_, step.reference);
    write_all(commands_, command_, step.command);
  }
  int history_depth() const {
    const std::uint32_t samples = (vehicles_ + FLEET_SAMPLE_VEHICLES - 1) / FLEET_SAMPLE_VEHICLES;
    return states_.history_depth() / static_cast<int>(samples);
  }

 private:
  template <class Sample, class Vehicle>
  void write_all(bus::Writer<Sample>& writer, Sample& sample, const Vehicle& vehicle) {
    sample.run_id(kRunId);
    sample.step(vehicle.step());
    for (std::uint32_t id = 0; id < vehicles_; ++id) {
      sample.vehicles().push_back(vehicle);
      sample.vehicles().back().vehicle_id(id);
      if (sample.vehicles().size() < FLEET_SAMPLE_VEHICLES && id + 1 < vehicles_) continue;
      writer.write(sample);
      sample.vehicles().clear();
    }
  }

  const std::uint32_t vehicles_;
  FleetState state_;  // members to keep their memory
  FleetReference reference_;
  FleetCommand command_;
  bus::Writer<FleetState> states_;
  bus::Writer<FleetReference> references_;
  bus::Writer<FleetCommand> commands_;
};

template <class Stream>
nlohmann::json feed(const config::Scenario& scenario, const FeederOptions& options) {
  std::vector<closed_loop::StepSamples> samples =
      closed_loop::fly_samples(scenario, options.steps, kRunId);
  samples.back().command.mission(MISSION_FINISHED);
  bus::Node node(options.qos_file, options.domain, "bench", "server");
  Stream stream(node, options.vehicles);
  Surroundings surroundings(node, scenario, options.vehicles);
  const std::uint64_t last = samples.size() - 1;
  const auto window = sim::calc_recorder_window(stream.history_depth());
  surroundings.wait(PHASE_WAITING, 0, "a recorder that is ready",
                    [](const Participant& recorder) { return recorder.ready(); });
  surroundings.announce(PHASE_RUNNING, 0);
  const auto began = Clock::now();
  for (const closed_loop::StepSamples& step : samples) {
    const auto number = static_cast<std::int64_t>(step.state.step());
    surroundings.wait(PHASE_RUNNING, step.state.step(), "the recorder",
                      [&](const Participant& recorder) {
                        return number - 1 - recorder.last_complete_step() < window;
                      });
    stream.write(step);
    surroundings.announce_if_due(PHASE_RUNNING, step.state.step());
  }
  surroundings.announce(PHASE_FINISHED, last);
  surroundings.wait(PHASE_FINISHED, last, "the recorder's last step",
                    [&](const Participant& recorder) {
                      return recorder.last_complete_step() == static_cast<std::int64_t>(last);
                    });
  const std::chrono::duration<double> elapsed = Clock::now() - began;
  surroundings.wait(PHASE_FINISHED, last, "the recorder's end",
                    [](const Participant& recorder) { return recorder.done(); });
  return {{"rows", kRowsOfStep * samples.size() * options.vehicles}, {"seconds", elapsed.count()}};
}

}  // namespace

nlohmann::json feed_recorder(const config::Scenario& scenario, const FeederOptions& options) {
  return options.vehicles > 1 ? feed<FleetStream>(scenario, options)
                              : feed<SingleStream>(scenario, options);
}

}  // namespace sls::bench
