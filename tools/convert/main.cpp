#include <spdlog/fmt/fmt.h>

#include "common/app/log.hpp"
#include "common/app/run_main.hpp"
#include "tools/convert/conversion.hpp"

int main(int argc, char** argv) {
  using namespace sls;
  app::CommandLine cli(
      "Writes a recording as one MCAP file for Foxglove, Lichtblick, PlotJuggler and others.\n"
      "Exit codes: 0 done; 1 recording damaged or file not writable; 2 not a recording.");
  std::filesystem::path folder, out;
  bool force = false;
  cli.add_option("DIR", folder, "folder of a recording").type_name("").required();
  cli.add_option("--out", out, "MCAP file (default: DIR/sls.mcap)").type_name("FILE");
  cli.add_flag("--force", force, "replace an existing file");
  return app::run_main(argc, argv, cli, {}, "sls_convert", [&] {
    const record::OpenedRecording flight = record::open_recording(folder);
    if (out.empty()) out = convert::make_default_output(flight);
    const std::uint64_t messages = convert::write_mcap(flight, out, force);
    app::print(fmt::format("{}: {} messages", out.string(), messages));
  });
}
