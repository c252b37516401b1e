/// Errors of a command line in the form of all others, and help that fits the terminal.
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>
#include <vector>

namespace sls::app {

/// CLI11's error as `PLACE: expected X, got 'Y'`. `words` are the arguments of the program.
std::string describe_usage_error(const CLI::ParseError& error, const CLI::App& cli,
                                 const std::vector<std::string>& words);

/// Columns of the terminal, or of the environment variable COLUMNS; 0 if stdout is no terminal.
std::size_t find_columns();

/// CLI11's help text with lines of at most `columns` where words allow; 0: as it is.
std::string fit(const std::string& help, std::size_t columns);

}  // namespace sls::app
