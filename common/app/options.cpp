#include "common/app/options.hpp"

#include <cstdlib>

#include "common/app/version.hpp"
#include "common/config/domain.hpp"

namespace sls::app {

void add_common_options(CLI::App& cli, CommonOptions& options) {
  cli.option_defaults()->always_capture_default();
  cli.add_option("--qos", options.qos_file, "QoS profiles (XML)")->type_name("FILE");
  constexpr const char* kDomainVariable = "SLS_DOMAIN";
  const auto* domain = cli.add_option("--domain", options.domain,
                                      "DDS domain, 0 to " + std::to_string(config::kMaxDomain))
                           ->type_name("N")
                           ->envname(kDomainVariable)
                           ->check(CLI::Range(0, config::kMaxDomain));
  // CLI11 2.4 ignores a variable that the check refuses; 2.1 throws.
  cli.parse_complete_callback([domain] {
    const char* value = std::getenv(kDomainVariable);
    if (value && *value && domain->empty())
      throw CLI::ValidationError("--domain", std::string(kDomainVariable) + ": expected 0 to " +
                                                 std::to_string(config::kMaxDomain) + ", got '" +
                                                 value + "'");
  });
  cli.add_option("--log-level", options.log_level, "least severe message shown on stderr")
      ->type_name("LEVEL")
      ->check(CLI::IsMember({"debug", "info", "warning", "error"}));
  cli.set_version_flag("--version", version());
}

}  // namespace sls::app
