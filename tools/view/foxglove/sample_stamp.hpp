/// The few fields of a sample that give its time, read where they lie in its CDR.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tools/view/live/feed.hpp"

namespace sls::view::foxglove {

struct SampleStamp {
  std::uint64_t run_id = 0;
  std::optional<std::uint64_t> step;        ///< of sls/record that of the first entry
  std::optional<std::int64_t> sim_time_ns;  ///< sls/state alone carries it
};

/// Nothing if the bytes end too early or are no plain CDR (XCDR1, either byte order).
std::optional<SampleStamp> read_stamp(TopicId topic, const std::vector<std::uint8_t>& cdr);

/// step × period, ns; at most what a ROS message can tell, 2³¹ − 1 s.
std::int64_t calc_sim_time(std::uint64_t step, std::int64_t period_ns);

}  // namespace sls::view::foxglove
