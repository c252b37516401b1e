/// Readers that take a share of a topic's samples (`bus::Share`): a writer sends them no others.
/// The means of DDS is a content filter. The reader announces its class, expression and parameters
/// in discovery, and a writer that knows the class applies it. Other writers send everything, and
/// the reader drops what exceeds its share. Fast DDS's own TIME_BASED_FILTER does nothing.
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/topic/ContentFilteredTopic.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/node.hpp"
#include "fastdds_api.hpp"

namespace sls::bus {

/// Chooses the samples of one reader. Pure: no clock.
class Thinning {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit Thinning(const Share& share) : share_(share) {}

  /// True if a sample written `now` belongs to the share. A window begins with the first sample
  /// after the end of the one before.
  bool passes(Time now) {
    if (now >= window_end_) {
      window_end_ = now + share_.window;
      passed_ = 0;
    }
    return passed_ < share_.most && ++passed_ > 0;
  }

 private:
  const Share share_;
  Time window_end_{};
  std::uint32_t passed_ = 0;
};

/// Names of the filter on the wire.
inline constexpr const char* kThinningClass = "sls.thinning";
inline constexpr const char* kThinningExpression = "at most %0 samples in %1 ms";

std::vector<std::string> to_parameters(const Share& share);

/// Nothing if `expression` is not kThinningExpression or a parameter is not a whole number, at
/// least 1 and at most 1,000 samples and 10,000 ms. They come from the network.
std::optional<Share> read_share(const std::string& expression,
                                const std::vector<std::string>& parameters);

/// Lets the writers of `participant` apply the filter, and its readers use it. Call it before it
/// has endpoints.
bool know_thinning(dds::DomainParticipant& participant);

/// The description of `topic` for a reader with `share`; null if Fast DDS refuses it. Delete it
/// after the reader.
dds::ContentFilteredTopic* make_share_of(dds::Topic& topic, const Share& share);

}  // namespace sls::bus
