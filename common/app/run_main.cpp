#include "common/app/run_main.hpp"

#include <spdlog/spdlog.h>

#include "common/app/command_line.hpp"
#include "common/app/log.hpp"
#include "common/app/stop_signal.hpp"
#include "common/config/config_error.hpp"

namespace sls::app {

int run_main(int argc, char** argv, CLI::App& cli, const CommonOptions& options,
             const std::string& program, const std::function<void()>& work) {
  start_log(program, "info");
  cli.name(program);
  try {
    cli.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_name() == "CallForHelp") {
      std::fputs(fit(cli.help()).c_str(), stdout);
      return kExitDone;
    }
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success))
      return cli.exit(error);  // --version
    spdlog::error("{} (see --help)", describe_usage_error(error, cli, {argv + 1, argv + argc}));
    return kExitBadUsage;
  }
  start_log(program, options.log_level);
  install_stop_signals();
  int code = kExitDone;
  try {
    work();
  } catch (const config::ConfigError& error) {
    spdlog::error("{}", error.what());
    code = kExitBadUsage;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    code = kExitRunFailed;
  } catch (...) {
    spdlog::error("an exception of unknown type");
    code = kExitRunFailed;
  }
  return stop_signal() == 0 ? code : 128 + stop_signal();
}

}  // namespace sls::app
