/// A run that failed.
#pragma once

#include <stdexcept>

namespace sls::app {

/// The run failed: the mission was not finished, a peer was lost, data was lost. Exit code 1.
class RunError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace sls::app
