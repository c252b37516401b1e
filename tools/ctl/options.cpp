#include "tools/ctl/options.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <string>
#include <system_error>

namespace sls::ctl {
namespace {

constexpr double kShortestTimeout = 0.1;  // s
constexpr double kLongestTimeout = 86400;
constexpr double kTimeoutOfOneLook = 3;  // discovery takes less, if no packet is lost

std::string check_timeout(const std::string& text) {
  double timeout_s = 0.0;
  const bool is_number = CLI::detail::lexical_cast(text, timeout_s);
  if (is_number && timeout_s >= kShortestTimeout && timeout_s <= kLongestTimeout) return "";
  return "expected " + std::to_string(kShortestTimeout).substr(0, 3) + " to " +
         std::to_string(static_cast<int>(kLongestTimeout)) + ", got " + text;
}

std::string check_steps(const std::string& text) {
  std::uint64_t steps = 0;  // CLI11 alone reads -1 as a very large number
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, steps);
  const bool is_count = error == std::errc() && rest == end && steps >= 1;
  return is_count ? "" : "expected a whole number, at least 1, got " + text;
}

}  // namespace

void add_options(CLI::App& cli, Options& options) {
  app::add_common_options(cli, options.common);
  cli.add_option("--vehicle", options.vehicle_id, "control the run of vehicle N")->type_name("N");
  auto* timeout = cli.add_option("--timeout-s", options.timeout_s,
                                 "time limit for finding a server, and for its reply, s "
                                 "(status without --watch: 3)");
  timeout->type_name("X")->check(check_timeout);
  cli.require_subcommand(0, 1);  // with 1 the error would not name the unknown command
  cli.callback([&cli] {
    if (cli.get_subcommands().empty())
      throw CLI::RequiredError("pause, step, resume, start, reset, stop or status");
  });
  cli.fallthrough();  // the flags above may also follow the subcommand

  const auto add_action = [&](const char* name, ControlAction action, const char* description) {
    auto* subcommand = cli.add_subcommand(name, description);
    subcommand->callback([&options, action] { options.action = action; });
    return subcommand;
  };
  add_action("pause", ControlAction::ACTION_PAUSE, "pause a running run after its current step");
  add_action("step", ControlAction::ACTION_STEP,
             "run N steps of a paused run and wait until they are done")
      ->add_option("N", options.steps, "control periods, at least 1")
      ->required()
      ->default_str("")
      ->check(check_steps);
  add_action("resume", ControlAction::ACTION_RESUME, "continue a paused run");
  add_action("start", ControlAction::ACTION_START,
             "start a run that is paused before its first step");
  add_action("reset", ControlAction::ACTION_RESET, "restart from step 0 with a new run_id");
  add_action("stop", ControlAction::ACTION_STOP, "end the run");
  auto* status = cli.add_subcommand("status", "print the status of the run");
  status->add_flag("--watch", options.watch, "repeat until the run has ended");
  status->add_flag("--json", options.json, "print one JSON object per line");
  status->callback([&options, timeout] {
    if (timeout->empty() && !options.watch) options.timeout_s = kTimeoutOfOneLook;
  });
}

}  // namespace sls::ctl
