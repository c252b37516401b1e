#include "common/bus/sync_counters.hpp"

#include <algorithm>
#include <stdexcept>

namespace sls::bus {

std::vector<Count> list_counts(const SyncCounters& counters, const std::string& prefix,
                               std::initializer_list<const char*> words) {
  std::vector<Count> counts;
  for (const char* text : words) {
    const std::string name = prefix + to_counter_name(text);
    const auto* found = std::find_if(kSyncCounters.begin(), kSyncCounters.end(),
                                     [&](const SyncCounter& known) { return known.name == name; });
    if (found == kSyncCounters.end()) throw std::logic_error("no counter of the name " + name);
    counts.push_back({text, (counters.*found->get)()});
  }
  return counts;
}

std::string to_counter_name(std::string words) {
  std::replace_if(
      words.begin(), words.end(), [](char letter) { return letter == ' ' || letter == '-'; }, '_');
  return words;
}

}  // namespace sls::bus
