#include <spdlog/spdlog.h>

#include <cstdio>

#include "common/app/log.hpp"
#include "common/app/run_error.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/bus/qos_file.hpp"
#include "tools/doctor/doctor.hpp"

int main(int argc, char** argv) {
  using namespace sls;
  app::CommandLine cli(
      "Finds out why data does not flow: sends datagrams and samples over each path and prints\n"
      "one line per check. Exit code 1: a check found a fault.");
  app::CommonOptions options;
  options.qos_file = bus::default_qos_file();
  doctor::DoctorOptions examination;
  bool is_json = false, is_answering = false;
  int seconds = 60;
  cli.add_common_options(options);
  const auto peer = cli.add_option("--peer", examination.peer,
                                   "another machine, running the programs or sls_doctor --answer "
                                   "(default: this machine)")
                        .type_name("HOST");
  cli.add_option("--identity", examination.identity, "role whose keys to use on a secured domain")
      .type_name("NAME");
  const auto json = cli.add_flag("--json", is_json, "print JSON");
  const auto answer = cli.add_flag("--answer", is_answering, "answer the doctor of another machine")
                          .excludes(peer)
                          .excludes(json);
  cli.add_option("--for-s", seconds, "duration of --answer, s")
      .type_name("S")
      .range(1, 3600)
      .needs(answer);

  return app::run_main(argc, argv, cli, options, "sls_doctor", [&] {
    examination.qos_file = options.qos_file;
    examination.domain = options.domain;
    const auto is_stopped = [] { return app::stop_signal() != 0; };
    if (is_answering) {
      spdlog::info("answering on domain {} for {} s", examination.domain, seconds);
      doctor::answer(examination, std::chrono::seconds(seconds), is_stopped);
      return;
    }
    const auto checks = doctor::examine(examination, is_stopped);
    if (is_stopped()) return;
    if (is_json)
      std::puts(doctor::to_json(checks).c_str());
    else
      for (const auto& check : checks) app::print(doctor::to_line(check));
    std::vector<std::string> findings;
    for (const auto& check : checks)
      if (check.verdict == doctor::Verdict::kFinding) findings.push_back(check.name);
    if (!findings.empty()) throw app::RunError("failed checks: " + doctor::join(findings));
  });
}
