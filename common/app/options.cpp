#include "common/app/options.hpp"

#include "common/config/domain.hpp"

namespace sls::app {

void add_common_options(CLI::App& cli, CommonOptions& options) {
  cli.option_defaults()->always_capture_default();
  cli.add_option("--qos", options.qos_file, "QoS profiles (XML)")->type_name("FILE");
  cli.add_option("--domain", options.domain,
                 "DDS domain, 0 to " + std::to_string(config::kMaxDomain))
      ->type_name("N")
      ->envname("SLS_DOMAIN")
      ->check(CLI::Range(0, config::kMaxDomain));
  cli.add_option("--log-level", options.log_level, "least severe message shown on stderr")
      ->type_name("LEVEL")
      ->check(CLI::IsMember({"debug", "info", "warning", "error"}));
  cli.set_version_flag("--version", version());
}

std::string version() { return "sls " SLS_VERSION; }

}  // namespace sls::app
