#include <spdlog/fmt/fmt.h>

#include "common/app/log.hpp"
#include "common/app/run_error.hpp"
#include "common/app/run_main.hpp"
#include "recorder/verification.hpp"

namespace {

using namespace sls;
using record::OpenedRecording;

void verify_one(const OpenedRecording& flight) {
  const record::Inspection inspection = record::inspect(flight);
  for (const std::string& problem : inspection.problems) app::print(problem);
  const auto& manifest = flight.manifest();
  if (!manifest.complete)
    app::print(fmt::format("not complete: {}: {}", manifest.outcome, manifest.reason));
  if (!manifest.missing.empty()) app::print(describe(manifest.missing));
  if (!inspection.problems.empty())
    throw app::RunError(flight.folder.string() + ": differs from its manifest");
  app::print(fmt::format("matches its manifest: {} steps, certificate {}", inspection.steps,
                         inspection.certificate));
}

void verify_two(const OpenedRecording& a, const OpenedRecording& b) {
  const record::Inspection of_a = record::inspect(a), of_b = record::inspect(b);
  for (const std::string& problem : of_a.problems) app::print("A: " + problem);
  for (const std::string& problem : of_b.problems) app::print("B: " + problem);
  for (const std::string& note : record::list_notes(a, b)) app::print(note);
  if (const auto difference = record::find_first_difference(a, b)) {
    app::print("first difference: " + difference->text);
    if (a.manifest().scenario_sha256 != b.manifest().scenario_sha256)
      throw app::RunError("A and B are flights of different scenarios");
    const auto deviations = record::list_deviations(a, b);
    if (!deviations.empty()) app::print("largest difference of each column that differs:");
    for (const auto& deviation : deviations) app::print("  " + describe(deviation));
    throw app::RunError("A and B differ");
  }
  if (of_a.steps == 0) throw app::RunError("nothing to compare: neither A nor B holds a step");
  app::print(fmt::format("equal: {} steps, certificate {}", of_a.steps, of_a.certificate));
}

}  // namespace

int main(int argc, char** argv) {
  app::CommandLine cli(
      "Compares two recordings, or the files of one recording with its manifest.\n"
      "Exit codes: 0 equal; 1 different or damaged; 2 not a recording.");
  std::filesystem::path a, b;
  cli.add_option("A", a, "folder of a recording").type_name("DIR").required();
  cli.add_option("B", b, "folder of a second recording (default: check A against its manifest)")
      .type_name("DIR");
  return app::run_main(argc, argv, cli, {}, "sls_verify", [&] {
    const OpenedRecording flight = record::open_recording(a);
    if (b.empty()) return verify_one(flight);
    verify_two(flight, record::open_recording(b));
  });
}
