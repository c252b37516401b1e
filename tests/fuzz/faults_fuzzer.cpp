/// Any text is a file of faults or causes a ConfigError. Each fault reads back from its line.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "common/config/config_error.hpp"
#include "common/config/faults.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sls;
  namespace faults = config::faults;
  faults::Abilities all{"fuzzer",
                        {"link.delay_ms", "link.jitter_ms", "link.loss", "link.reordering",
                         "link.reordering_ms", "link.duplicates", "link.bandwidth_mbit",
                         "link.mtu_bytes", "link.multicast", "step", "until_s"},
                        {}};
  for (const auto& kind : names_of(faults::Kind())) all.words.insert(kind.text);
  std::vector<faults::Case> cases;
  try {
    cases = faults::parse(std::string(data, data + size), "input", all);
  } catch (const config::ConfigError&) {
    return 0;
  }
  for (const faults::Case& one : cases)
    for (const faults::Fault& fault : one.faults) {
      const std::string line = faults::to_line(fault);
      const auto again = faults::parse("faults: [" + line + "]", "line", all);
      if (faults::to_line(again.at(0).faults.at(0)) != line) std::abort();
    }
  return 0;
}
