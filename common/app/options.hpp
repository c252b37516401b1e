/// The command line every program shares.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

namespace sls::app {

/// Flags that every program takes.
struct CommonOptions {
  std::filesystem::path qos_file;
  int domain = 0;
  std::string log_level = "info";
};

/// Declares `--qos`, `--domain`, `--log-level` and `--version`; `--help` prints every default. The
/// domain is that of `--domain`, else that of the environment variable SLS_DOMAIN, else 0.
void add_common_options(CLI::App& cli, CommonOptions& options);

}  // namespace sls::app
