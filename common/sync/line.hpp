#pragma once

#include <string>

namespace sls::sync {

/// A line for the log.
struct Line {
  bool is_warning = false;
  std::string text;
};

}  // namespace sls::sync
