/// Errors of a command line in the form of all others, and help that fits a terminal.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace sls::app {

/// CLI11's error as `PLACE: expected X, got 'Y'`. `words` are the arguments of the program.
std::string describe_usage_error(const CLI::ParseError& error, const CLI::App& cli,
                                 const std::vector<std::string>& words);

/// CLI11's help text with lines of at most 80 columns where words allow.
std::string fit(const std::string& help);

}  // namespace sls::app
