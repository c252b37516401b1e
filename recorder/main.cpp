#include "common/app/run_main.hpp"
#include "common/bus/node.hpp"
#include "recorder/recorder.hpp"
#include "recorder/recording_folder.hpp"

int main(int argc, char** argv) {
  using namespace sls;
  CLI::App cli("Writes every sample of a run to CSV files.");
  app::CommonOptions options;
  options.qos_file = bus::default_qos_file();
  std::filesystem::path folder;
  bool force = false;
  app::add_common_options(cli, options);
  cli.add_option("--out", folder, "folder of the recording, new or empty")
      ->type_name("DIR")
      ->required();
  cli.add_flag("--force", force, "replace the recording that is there");

  return app::run_main(argc, argv, cli, options, "recorder", [&] {
    record::prepare_recording_folder(folder, force);
    bus::Node node(options.qos_file, options.domain, "recorder");
    record::Recorder(node, folder).run();
  });
}
