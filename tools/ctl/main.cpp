#include <spdlog/spdlog.h>

#include <iostream>

#include "common/app/run_error.hpp"
#include "common/app/run_main.hpp"
#include "common/bus/end_process.hpp"
#include "common/bus/node.hpp"
#include "common/bus/qos_file.hpp"
#include "tools/ctl/operator_client.hpp"
#include "tools/ctl/options.hpp"
#include "tools/ctl/screen.hpp"
#include "tools/ctl/show_status.hpp"

namespace {

using namespace sls;

constexpr const char* kIdentity = "operator";  // role whose keys it uses on a secured domain

/// @throws app::RunError with the server's reason if it refuses.
void request(ctl::OperatorClient& client, ControlAction action, std::uint64_t steps) {
  const auto run = client.wait_for_run();
  if (!run) return;  // interrupted
  const auto reply = client.ask(*run, action, steps);
  if (!reply) return;
  // The server may also have begun the steps and ended them early.
  const char* outcome = action == ControlAction::ACTION_STEP ? "not carried out" : "refused";
  if (!reply->accepted())
    throw app::RunError(fmt::format("{} {} at step {}: {}", ctl::to_string(action), outcome,
                                    reply->step(), reply->reason().c_str()));
  spdlog::info("{} done at step {} of run {:016x}", ctl::to_string(action), reply->step(),
               run->parameters.run_id());
}

}  // namespace

int main(int argc, char** argv) {
  app::CommandLine cli("Controls a run and prints its status, from any machine on the domain.");
  ctl::Options options;
  options.common.qos_file = bus::default_qos_file();
  ctl::add_options(cli.app(), options);

  const int code = app::run_main(argc, argv, cli, options.common, "sim_ctl", [&] {
    bus::Node node(options.common.qos_file, options.common.domain, "sim_ctl", kIdentity);
    ctl::ClientOptions client_options;
    client_options.domain = options.common.domain;
    client_options.vehicle_id = options.vehicle_id;
    client_options.timeout_s = options.timeout_s;
    client_options.asks = options.action.has_value();
    ctl::OperatorClient client(node, client_options);
    if (options.action) return request(client, *options.action, options.steps);
    ctl::ShowOptions show_options;
    show_options.watch = options.watch;
    show_options.json = options.json;
    show_options.terminal = ctl::is_terminal();
    show_options.timeout_s = options.timeout_s;
    ctl::show_status(client, show_options, std::cout);
  });
  bus::end_process(code);
}
