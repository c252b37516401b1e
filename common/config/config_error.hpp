#pragma once

#include <stdexcept>

namespace sls::config {

/// A mistake in a configuration file or in what the user asked for. `what()` is one line:
/// `FILE:LINE: KEY: expected …, got …`. Programs print it and end with exit code 2.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace sls::config
