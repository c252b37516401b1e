#include <iostream>
#include <optional>

#include "common/app/run_main.hpp"
#include "common/app/scheduling.hpp"
#include "common/bus/end_process.hpp"
#include "common/bus/node.hpp"
#include "common/bus/qos_file.hpp"
#include "common/bus/security_files.hpp"
#include "recorder/columns.hpp"
#include "recorder/recorder.hpp"
#include "recorder/recording_folder.hpp"

namespace {

constexpr const char* kIdentity = "recorder";  // name of its keys on a secured domain

}  // namespace

int main(int argc, char** argv) {
  using namespace sls;
  app::CommandLine cli("Records every step of a run in CSV files.");
  app::CommonOptions options;
  options.qos_file = bus::default_qos_file();
  record::RecorderOptions recorder;
  bool force = false;
  bool resume = false;
  bool check = false;
  cli.add_common_options(options);
  cli.add_option("--out", recorder.folder, "folder of the recording, new or empty")
      .type_name("DIR")
      .required();
  cli.add_option("--vehicle", recorder.vehicle, "record the run of the server that flies vehicle N")
      .type_name("N");
  const auto force_flag = cli.add_flag("--force", force, "replace an existing recording");
  cli.add_flag("--resume", resume, "continue an unfinished recording, if there is one")
      .excludes(force_flag);
  cli.add_flag("--follow", recorder.follow,
               "when another server replaces the first, record its run in a subfolder");
  cli.add_print_flag(
      "--columns", [] { std::cout << record::describe_columns(); },
      "print the columns of every file as Markdown and exit");
  cli.add_flag("--check", check, "check QoS file and folder and exit");

  const int code = app::run_main(argc, argv, cli, options, "recorder", [&] {
    bus::check_security_files(bus::read_qos_file(options.qos_file, kIdentity));
    std::optional<record::RecordingFolder> folder;
    if (resume)
      recorder.unfinished = record::find_unfinished_recording(recorder.folder);
    else
      folder.emplace(recorder.folder, force);
    if (check) return;
    // The loop waits for server and client, not for the recorder, so those have priority. Set
    // before any thread starts, because threads inherit it. A refusal does no harm.
    app::put_thread_last();
    bus::Node node(options.qos_file, options.domain, bus::kRecorderNode, kIdentity,
                   bus::Transports::kAllWithLongQueue);
    record::Recorder(node, recorder).run();
  });
  bus::end_process(code);
}
