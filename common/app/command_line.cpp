#include "common/app/command_line.hpp"

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <vector>

#include "common/app/version.hpp"
#include "common/config/domain.hpp"

namespace sls::app {

Option Option::type_name(const std::string& name) const { return Option(option_->type_name(name)); }

Option Option::required() const { return Option(option_->required()); }

Option Option::repeatable(int least, int most) const {
  return Option(
      option_->expected(least, most)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll));
}

Option Option::no_default() const { return Option(option_->default_str("")); }

Option Option::range(int least, int most) const {
  return Option(option_->check(CLI::Range(least, most)));
}

Option Option::one_of(const std::initializer_list<std::string>& words) const {
  return Option(option_->check(CLI::IsMember(std::vector<std::string>(words))));
}

Option Option::check(const std::function<std::string(const std::string&)>& find_defect) const {
  return Option(option_->check(CLI::Validator(find_defect, "")));
}

Option Option::excludes(Option other) const { return Option(option_->excludes(other.option_)); }

Option Option::needs(Option other) const { return Option(option_->needs(other.option_)); }

CommandLine::CommandLine(const std::string& description)
    : app_(std::make_unique<CLI::App>(description)) {
  app_->set_version_flag("--version", version());
}

CommandLine::~CommandLine() = default;

void CommandLine::add_common_options(CommonOptions& options) {
  app::add_common_options(*app_, options);
}

template <class Value>
Option CommandLine::add_option(const std::string& name, Value& value, const std::string& help) {
  return Option(app_->add_option(name, value, help));
}
using Path = std::filesystem::path;
template Option CommandLine::add_option(const std::string&, int&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::uint16_t&, const std::string&);
template Option CommandLine::add_option(const std::string&, unsigned&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::uint64_t&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::string&, const std::string&);
template Option CommandLine::add_option(const std::string&, Path&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::optional<std::uint32_t>&,
                                        const std::string&);
template Option CommandLine::add_option(const std::string&, std::optional<std::uint64_t>&,
                                        const std::string&);
template Option CommandLine::add_option(const std::string&, std::optional<double>&,
                                        const std::string&);
template Option CommandLine::add_option(const std::string&, std::vector<std::string>&,
                                        const std::string&);
template Option CommandLine::add_option(const std::string&, std::vector<Path>&, const std::string&);

Option CommandLine::add_flag(const std::string& name, bool& value, const std::string& help) {
  return Option(app_->add_flag(name, value, help));
}

void CommandLine::add_print_flag(const std::string& name, const std::function<void()>& print,
                                 const std::string& help) {
  const auto print_and_end = [print] {
    print();
    throw CLI::Success();
  };
  // Before CLI11 misses required options: 2.6 would look for those first.
  app_->add_flag_callback(name, print_and_end, help)->trigger_on_parse();
}

void CommandLine::footer(const std::string& text) { app_->footer(text); }

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
      throw CLI::ValidationError(
          kDomainVariable,
          "expected 0 to " + std::to_string(config::kMaxDomain) + ", got '" + value + "'");
  });
  cli.add_option("--log-level", options.log_level, "least severe message shown on stderr")
      ->type_name("LEVEL")
      ->check(CLI::IsMember({"debug", "info", "warning", "error"}));
}

}  // namespace sls::app
