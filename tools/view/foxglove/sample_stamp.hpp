/// The fields of a sample that give its time, read directly from its CDR bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tools/view/live/feed.hpp"

namespace sls::view::foxglove {

struct SampleStamp {
  std::uint64_t run_id = 0;
  std::optional<std::uint64_t> step;        ///< for sls/record that of the first entry
  std::optional<std::int64_t> sim_time_ns;  ///< only sls/state has it
};

/// Returns nothing if the bytes end too early or are not plain CDR (XCDR1, either byte order).
std::optional<SampleStamp> read_stamp(TopicId topic, const std::vector<std::uint8_t>& cdr);

/// step × period, ns; at most 2³¹ − 1 s, the limit of a ROS message.
std::int64_t calc_sim_time(std::uint64_t step, std::int64_t period_ns);

}  // namespace sls::view::foxglove
