/// Writers and readers as discovery tells them, and why two of them do not match.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/fastdds/endpoint_facts.hpp"
#include "common/bus/peer.hpp"

namespace sls::doctor {

struct Endpoint : bus::EndpointFacts {
  bus::PeerId participant;
  std::string owner;           ///< for people: "sim_server of 10.77.0.1", "this QoS file"
  std::uint32_t max_size = 0;  ///< of a writer: bytes of its largest sample; 0 unknown
};

/// Why a writer and a reader of one topic do not match.
struct Mismatch {
  std::string topic;
  std::string policy;  ///< "RELIABILITY", "type"
  std::string text;  ///< "RELIABILITY: offered best effort, asked reliable (sim_server, recorder)"
};

/// All pairs of `endpoints` on the same topic, those of one participant with itself left out; each
/// topic and policy once.
std::vector<Mismatch> find_policy_mismatches(const std::vector<Endpoint>& endpoints);

/// Endpoints of one topic whose types have different names, or whose largest samples differ in
/// size: another layout under the same name. Each topic once.
std::vector<Mismatch> find_type_mismatches(const std::vector<Endpoint>& endpoints);

}  // namespace sls::doctor
