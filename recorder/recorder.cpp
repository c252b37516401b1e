#include "recorder/recorder.hpp"

#include <chrono>

#include "common/app/log.hpp"
#include "common/app/run_error.hpp"
#include "common/app/scheduling.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/wait.hpp"

namespace sls::record {

using namespace std::chrono_literals;

RecorderCore::Options make_core_options(const RecorderOptions& options, const std::string& host) {
  RecorderCore::Options made;
  made.folder = options.folder.string();
  made.identity.contract_sha256(bus::kContractSha256);
  made.identity.host(host);
  made.vehicle = options.vehicle;
  made.follows_servers = options.follow;
  made.has_subfolder = [folder = options.folder](std::uint64_t run_id) {
    return std::filesystem::exists(folder / name_run(run_id));
  };
  if (options.unfinished) {
    const ManifestFile& manifest = options.unfinished->manifest();
    made.unfinished = {manifest.run_id, manifest.outcome, options.unfinished->vehicle_ids()};
  }
  return made;
}

Segment make_segment(const RecorderOptions& options, const RecorderCore& core) {
  Segment segment;
  segment.folder = options.folder;
  if (core.place() == RecorderCore::Place::kFolder) return segment;
  if (core.place() == RecorderCore::Place::kNextSegment)
    return make_next_segment(*options.unfinished);
  segment.folder = options.folder / name_run(core.run()->parameters.run_id());
  const auto earlier = find_unfinished_recording(segment.folder);
  return earlier ? make_next_segment(*earlier) : segment;
}

Recorder::Recorder(bus::Node& node, const RecorderOptions& options)
    : options_(options),
      node_(node),
      core_(make_core_options(options, bus::host_name())),
      participants_(node),
      servers_(node),
      announcer_(node),
      inbox_(node,
             [this](std::uint64_t run_id) { return servers_.may_fly(run_id, core_.vehicle()); }) {}

void Recorder::run() {
  announce();
  for (act(look()); core_.phase() != RecorderCore::Phase::kEnded; act(look())) {
    announcer_.repeat_if_due();
    app::sleep_until(core_.next_deadline());
  }
  if (!core_.error().empty())
    throw app::RunError(core_.error() + (core_.run() ? "" : node_.describe_isolation()));
}

void Recorder::act(RecorderCore::Act act) {
  if (act == RecorderCore::Act::kOpen) open();
  if (act == RecorderCore::Act::kAnnounce) announce();
  if (act == RecorderCore::Act::kClose) writing_->close(core_.watch_end());
  if (act == RecorderCore::Act::kReport) report();
}

RecorderCore::Act Recorder::look() {
  servers_.look_for_impostors();
  const RecorderCore::Now now = look_around();
  const auto act =
      servers_.ask([&](const sync::Servers& servers) { return core_.look(servers, now); });
  const bool is_finding = core_.phase() == RecorderCore::Phase::kFinding;
  for (const sync::Line& line : core_.take_lines())
    app::log({line.is_warning, line.text + (is_finding ? node_.describe_isolation() : "")});
  return act;
}

RecorderCore::Now Recorder::look_around() const {
  RecorderCore::Now now;
  now.time = app::awake_clock().now();
  now.interruption = app::describe_stop();
  if (!writing_) return now;
  now.is_closed = writing_->has_ended();  // first: the last step does not change after it
  now.hears_server = inbox_.hears(core_.run()->server);
  now.last_complete_step = writing_->last_complete_step();
  return now;
}

void Recorder::open() {
  const sync::Run& run = *core_.run();
  const auto scenario =
      config::parse_scenario(run.parameters.scenario_text().to_string(), "sls/parameters");
  writing_ =
      std::make_unique<WritingThread>(inbox_, participants_, run, make_segment(options_, core_));
  announce();
  // A process that writes into a port of shared memory waits for its reader, even if the reader has
  // just lost its processor.
  if (run.parameters.mode() == SyncMode::MODE_REALTIME) app::put_process_first();
  writing_->start();
  core_.on_opened(scenario.sync.wait.server_deadline_s, look_around());
}

void Recorder::report() {
  announce();
  // Other programs wait for the last announcement of this recorder before they end, so it must
  // reach them; above all its server, which may not have discovered it yet.
  const bus::PeerId server = core_.run()->server;
  const app::Wait wait(2);
  while (servers_.is_present(server) && !announcer_.reaches(server) && !wait.is_over())
    app::sleep_for(app::kShortPollTime);
  announcer_.wait_for_acknowledgments(1s);
  core_.on_recorded(writing_->recorded(), app::describe_stop());
  writing_.reset();
  for (const sync::Line& line : core_.take_lines()) app::log(line);
}

void Recorder::announce() {
  announcer_.announce(core_.make_announcement(writing_ ? writing_->last_complete_step() : -1,
                                              writing_ && writing_->has_failed()));
}

}  // namespace sls::record
