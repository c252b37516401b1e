#pragma once

#include <memory>
#include <vector>

#include "tests/system/process.hpp"

namespace sls::test {

/// Keeps `cores` cores busy while it lives.
class Load {
 public:
  explicit Load(unsigned cores) {
    for (unsigned i = 0; i < cores; ++i)
      burners_.push_back(
          std::make_unique<Process>(std::vector<std::string>{"sh", "-c", "while :; do :; done"}));
  }

 private:
  std::vector<std::unique_ptr<Process>> burners_;
};

}  // namespace sls::test
