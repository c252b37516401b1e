#include "bench/feeder.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "bench/flown_run.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/wait.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "sim_server/core/participants/roster.hpp"
#include "sim_server/endpoints.hpp"
#include "sim_server/record_stream.hpp"

namespace sls::bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kRunId = 1;
constexpr double kPatience_s = 60.0;
constexpr auto kAnnounceTime = 500ms;
constexpr std::size_t kRowsOfStep = 4;

/// Announcements of the server and of the recorder.
class Surroundings {
 public:
  Surroundings(bus::Node& node, const config::Scenario& scenario, std::uint32_t vehicles)
      : participants_(node), parameters_(node), statuses_(node) {
    parameters_.write(make_parameters(scenario, kRunId, vehicles));
    announce(RunPhase::PHASE_WAITING, 0);
  }

  void announce(RunPhase phase, std::uint64_t step) {
    statuses_.write(make_status(kRunId, index_++, phase, step));
    announced_ = Clock::now();
  }

  /// Returns when `is_over` is true for the last announcement of the recorder. Until then it
  /// publishes the status of the run when it is due.
  void wait(RunPhase phase, std::uint64_t step, const char* what,
            const std::function<bool(const Participant&)>& is_over) {
    const app::Wait wait(kPatience_s);
    while (true) {
      if (participants_.version() != version_) {
        version_ = participants_.version();
        recorders_ = participants_.find(ParticipantRole::ROLE_RECORDER, kRunId);
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
  std::uint64_t index_ = 0;
  Clock::time_point announced_;
  std::uint64_t version_ = 0;
  std::vector<sync::Member> recorders_;
};

}  // namespace

nlohmann::json feed_recorder(const config::Scenario& scenario, const FeederOptions& options) {
  std::vector<model::StepRecord> records = fly_records(scenario, options.steps);
  bus::Node node(options.qos_file, options.domain, "bench", "server");
  bus::Writer<RecordBatch> writer(node);
  Surroundings surroundings(node, scenario, options.vehicles);
  sim::RecordStream stream(writer, node.max_batch_bytes(), kRunId);
  const std::uint64_t last = records.size() - 1;
  surroundings.wait(RunPhase::PHASE_WAITING, 0, "a recorder that is ready",
                    [](const Participant& recorder) { return recorder.ready(); });
  surroundings.announce(RunPhase::PHASE_RUNNING, 0);
  std::vector<model::StepRecord> fleet(options.vehicles);
  const auto began = Clock::now();
  for (const model::StepRecord& flown : records) {
    const auto step = static_cast<std::int64_t>(flown.step);
    surroundings.wait(
        RunPhase::PHASE_RUNNING, flown.step, "the recorder", [&](const Participant& recorder) {
          return !stream.is_full() && step - 1 - recorder.last_complete_step() <
                                          sim::calc_recorder_window(stream.history_steps());
        });
    for (std::size_t i = 0; i < fleet.size(); ++i) {
      fleet[i] = flown;
      fleet[i].vehicle_id = static_cast<std::uint32_t>(i);
    }
    stream.add_step(fleet);
    surroundings.announce_if_due(RunPhase::PHASE_RUNNING, flown.step);
  }
  stream.end();
  surroundings.announce(RunPhase::PHASE_FINISHED, last);
  surroundings.wait(RunPhase::PHASE_FINISHED, last, "the recorder's last step",
                    [&](const Participant& recorder) {
                      return recorder.last_complete_step() == static_cast<std::int64_t>(last);
                    });
  const std::chrono::duration<double> elapsed = Clock::now() - began;
  surroundings.wait(RunPhase::PHASE_FINISHED, last, "the recorder's end",
                    [](const Participant& recorder) { return recorder.done(); });
  return {{"rows", kRowsOfStep * records.size() * options.vehicles}, {"seconds", elapsed.count()}};
}

}  // namespace sls::bench
