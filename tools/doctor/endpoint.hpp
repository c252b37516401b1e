/// Writers and readers as discovery tells them, and why two of them do not match.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/peer.hpp"

namespace sls::doctor {

/// Longer than any duration a profile holds.
inline constexpr std::int64_t kForeverNs = INT64_MAX;

/// The policies that decide whether a writer and a reader match (DDS 1.4, 2.2.3). Where kinds are
/// ordered, a writer must offer at least what the reader asks for.
struct Policies {
  int reliability = 0;  ///< 0 BEST_EFFORT, 1 RELIABLE
  int durability = 0;   ///< 0 VOLATILE, 1 TRANSIENT_LOCAL, 2 TRANSIENT, 3 PERSISTENT
  std::int64_t deadline_ns = kForeverNs;
  int liveliness = 0;  ///< 0 AUTOMATIC, 1 MANUAL_BY_PARTICIPANT, 2 MANUAL_BY_TOPIC
  std::int64_t liveliness_lease_ns = kForeverNs;
  int ownership = 0;                    ///< 0 SHARED, 1 EXCLUSIVE; must be equal
  std::vector<std::string> partitions;  ///< none: the default one
};

struct Endpoint {
  bus::PeerId participant;
  std::string owner;  ///< for people: "sim_server of 10.77.0.1", "this QoS file"
  std::string topic;
  std::string type;
  bool is_writer = false;
  std::uint32_t max_size = 0;  ///< of a writer: bytes of its largest sample; 0 unknown
  Policies policies;
};

/// Why a writer and a reader of one topic do not match.
struct Mismatch {
  std::string topic;
  std::string policy;  ///< "reliability", "type"
  std::string text;    ///< "sim_server offers reliability BEST_EFFORT, recorder asks for RELIABLE"
};

std::vector<Mismatch> find_policy_mismatches(const Endpoint& writer, const Endpoint& reader);

/// All pairs of `endpoints` on the same topic, those of one participant with itself left out; each
/// topic and policy once.
std::vector<Mismatch> find_policy_mismatches(const std::vector<Endpoint>& endpoints);

/// Endpoints of one topic whose types have different names, or whose largest samples differ in
/// size: another layout under the same name. Each topic once.
std::vector<Mismatch> find_type_mismatches(const std::vector<Endpoint>& endpoints);

}  // namespace sls::doctor
