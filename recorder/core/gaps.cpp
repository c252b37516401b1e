#include "recorder/core/gaps.hpp"

#include <spdlog/fmt/fmt.h>

#include "recorder/rows.hpp"

namespace sls::record {

std::string describe(const MissingSamples& missing) {
  std::uint64_t steps = missing.further_samples;
  for (const MissingSteps& gap : missing.listed) steps += gap.to - gap.from + 1;
  const MissingSteps& first = missing.listed.front();
  const char* unit = first.topic == StatusRow::kTopic ? "sample"
                     : first.topic == kBatchTopic     ? "batch"
                                                      : "step";
  return fmt::format("{} samples missing, first {} {} {} of vehicle {}", steps, first.topic, unit,
                     first.from, first.vehicle_id);
}

void GapList::add(std::uint32_t vehicle_id, const char* topic, std::uint64_t from,
                  std::uint64_t to) {
  const auto [last, is_first] = last_gaps_.try_emplace({vehicle_id, topic});
  LastGap& gap = last->second;
  const bool is_new = is_first || gap.to + 1 != from;
  gap.to = to;
  if (is_new) gap.index = missing_.listed.size();
  if (gap.index == MissingSamples::kMaxListed) {
    missing_.further_gaps += is_new ? 1 : 0;
    missing_.further_samples += to - from + 1;
  } else if (is_new) {
    missing_.listed.push_back({vehicle_id, topic, from, to});
  } else {
    missing_.listed[gap.index].to = to;
  }
}

}  // namespace sls::record
