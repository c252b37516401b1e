#include <spdlog/spdlog.h>

#include <csignal>
#include <optional>

#include "common/app/run_main.hpp"
#include "common/app/scheduling.hpp"
#include "common/app/stop_signal.hpp"
#include "common/bus/node.hpp"
#include "common/bus/qos_file.hpp"
#include "common/config/config_error.hpp"
#include "common/sync/servers.hpp"
#include "recorder/sinks/csv/csv_reader.hpp"
#include "tools/view/foxglove/session.hpp"
#include "tools/view/live/feed.hpp"
#include "tools/view/live/operator.hpp"
#include "tools/view/live/page_protocol.hpp"
#include "tools/view/page/page.hpp"
#include "tools/view/replay/export.hpp"
#include "tools/view/replay/recorded_run.hpp"
#include "tools/view/replay/shown_recording.hpp"
#include "tools/view/ros_face/ros_face.hpp"
#include "tools/view/web/server.hpp"

namespace {

using namespace sls;

constexpr double kSignalTime = 0.1;  // s between two looks for a stop signal
// Looks after SIGTERM, which `sls run --view` sends after the flight: open pages still ask for the
// recording, and get it.
constexpr int kLeastLooks = 5, kMostLooks = 100;

// --- the command line ----------------------------------------------------------------------------

struct Options {
  app::CommonOptions common;
  std::vector<std::filesystem::path> recordings;      ///< empty: live
  std::filesystem::path export_file;                  ///< empty: serve the page
  std::size_t most_bytes = view::kMostExportedBytes;  ///< size limit of `export_file`
  std::uint32_t vehicle_id = 0;
  std::string identity = "viewer";  ///< role whose keys it uses on a secured domain
  bool has_ros_face = false;
  std::filesystem::path token_file;       ///< empty: no token
  std::filesystem::path shown_recording;  ///< empty: "recordings"
  view::ServerOptions server;

  /// Puts the token and the address into `server`.
  /// @throws config::ConfigError as load_token and `check`, and if two options exclude each other.
  void complete();
};

void add_options(app::CommandLine& cli, Options& options) {
  cli.add_common_options(options.common);
  cli.add_option("DIR", options.recordings,
                 "one or two recordings to replay (default: the live flight on the domain)")
      .repeatable(0, 2)
      .type_name("")
      .no_default();
  cli.add_option("--recording", options.shown_recording,
                 "recording of the live flight, or a folder of recordings: a page opened late "
                 "gets from it what was flown before, at the end all (default: recordings)")
      .type_name("DIR")
      .no_default();
  cli.add_option("--vehicle", options.vehicle_id, "watch the server that flies vehicle N")
      .type_name("N");
  cli.add_option("--listen", options.server.address,
                 "address to listen on; addresses other than loopback need --token-file")
      .type_name("ADDRESS");
  cli.add_option("--port", options.server.port, "port to listen on; 0: any free port")
      .type_name("N")
      .range(0, 65535);
  cli.add_option("--token-file", options.token_file,
                 "file whose first line is the token that enables a page's buttons")
      .type_name("FILE");
  cli.add_flag("--read-only", options.server.access.is_read_only, "show no buttons on any page");
  cli.add_option("--allow-origin", options.server.access.allowed_origins,
                 "other origin whose pages may connect, and operate with the token, such as "
                 "https://app.foxglove.dev; repeatable")
      .type_name("URL")
      .repeatable(1, 1)
      .no_default();
  cli.add_flag("--ros", options.has_ros_face, "also publish the flight on ROS 2 topics");
  cli.add_option("--identity", options.identity,
                 "role whose keys to use on a secured domain; operator enables buttons")
      .type_name("NAME");
  cli.add_option("--export", options.export_file,
                 "write a page that contains the recordings to FILE and exit")
      .type_name("FILE");
  cli.add_option("--most-bytes", options.most_bytes,
                 "largest size of the file of --export; steps are left out to fit")
      .type_name("N");
}

void Options::complete() {
  if (!export_file.empty() && recordings.empty())
    throw config::ConfigError("--export: expected a recording with it, got none");
  if (has_ros_face && !recordings.empty())
    throw config::ConfigError("--ros: expected no recording with it, got " +
                              recordings.front().string());
  if (!shown_recording.empty() && !recordings.empty())
    throw config::ConfigError("--recording: expected no recording to replay with it, got " +
                              recordings.front().string());
  if (shown_recording.empty()) shown_recording = "recordings";
  if (!token_file.empty()) server.access.token = view::load_token(token_file.string());
  server.access.address = server.address;
  view::check(server.access);
}

// --- what it does --------------------------------------------------------------------------------

view::Resource make_page() {
  view::Resource page;
  page.content_type = "text/html; charset=utf-8";
  page.body = std::make_shared<const std::string>(view::unzip(view::page_html_gz()));
  page.gzip_body = std::make_shared<const std::string>(view::page_html_gz());
  return page;
}

/// Serves until a stop signal; after SIGTERM until `is_idle`, too.
void serve(
    view::Server& server, const std::function<bool()>& is_idle = [] { return true; }) {
  server.repeat(kSignalTime, [&server, is_idle, looks = 0]() mutable {
    const int signal = app::stop_signal();
    const bool may_linger =
        signal == SIGTERM && server.count_connections() > 0 && ++looks < kMostLooks;
    if (signal != 0 && !(may_linger && (looks < kLeastLooks || !is_idle()))) server.stop();
  });
  spdlog::info("page: {}", server.url());
  server.run();
}

/// The answer of /history: the recording of the run that is shown, or a text that says why not.
void answer_history(const view::Feed& feed, view::ShownRecording& recording,
                    const std::function<void(const view::Resource&)>& done) {
  const auto answer = [done](bool is_there, const view::Payload& bytes) {
    done({is_there ? "application/octet-stream" : "text/plain; charset=utf-8", bytes, {}, {}});
  };
  const view::RunView* view = feed.run();
  if (!view) return answer(false, std::make_shared<const std::string>("there is no flight"));
  const bool is_over = view->run.status && sync::calc_progress(view->run.status) < 0;
  recording.ask(view->run.parameters.run_id(), is_over, answer);
}

void watch(const Options& options) {
  view::Server server(options.server);
  bus::Node node(options.common.qos_file, options.common.domain, "sls_view", options.identity,
                 bus::Transports::kNetwork);
  const auto post = [&server](std::function<void()> task) { server.post(std::move(task)); };
  view::Feed feed(node, options.vehicle_id, post);
  view::Operator requests(node, options.vehicle_id, post, view::may_write_requests(node));

  view::PageOptions page;
  page.domain = options.common.domain;
  page.vehicle_id = options.vehicle_id;
  page.takes_token = options.server.access.token && !options.server.access.is_read_only;
  server.add_protocol(view::make_page_protocol(feed, requests, page));
  server.add_protocol(view::make_foxglove_protocol(feed, requests));
  server.add_resource("/", make_page());
  view::ShownRecording recording(options.shown_recording, post);
  server.add_resource("/history", [&](const auto& done) { answer_history(feed, recording, done); });
  std::optional<view::RosFace> ros_face;
  if (options.has_ros_face) ros_face.emplace(node, feed);
  serve(server, [&recording] { return recording.is_idle(); });
}

/// Reads everything once at the start, because recordings do not change while they are shown.
void replay(const Options& options) {
  view::Server server(options.server);
  const std::size_t count = options.recordings.size();
  for (std::size_t index = 0; index < count; ++index) {
    view::Resource recording;
    recording.content_type = "application/octet-stream";
    recording.body = std::make_shared<const std::string>(
        view::load_recorded_run(options.recordings[index], view::kMostServedBytes));
    server.add_resource("/recording/" + std::to_string(index), recording);
  }
  view::Resource page;
  page.content_type = "text/html; charset=utf-8";
  page.body =
      std::make_shared<const std::string>(view::make_replay_page(view::page_html_gz(), count));
  server.add_resource("/", page);
  serve(server);
}

void run(const Options& options) {
  if (!options.export_file.empty())
    view::export_page(options.export_file, view::page_html_gz(), options.recordings,
                      options.most_bytes);
  else if (!options.recordings.empty())
    replay(options);
  else
    watch(options);
}

/// A damaged recording counts as bad usage: exit code 2.
void run_checked(const Options& options) {
  try {
    run(options);
  } catch (const record::DamagedError& error) {
    throw config::ConfigError(error.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  app::CommandLine cli(
      "Shows a live or recorded flight in the browser, and a live one in Foxglove and ROS 2.");
  Options options;
  options.common.qos_file = bus::default_qos_file();
  add_options(cli, options);

  return app::run_main(argc, argv, cli, options.common, "sls_view", [&] {
    options.complete();
    // Before any thread starts, because threads inherit the priority.
    app::put_viewer_last();
    run_checked(options);
  });
}
