/// Discovered writers and readers, and why two of them do not match.
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
  std::uint32_t max_size = 0;  ///< largest sample of a writer, bytes; 0: unknown
};

/// Why a writer and a reader of one topic do not match.
struct Mismatch {
  std::string topic;
  std::string policy;  ///< "RELIABILITY", "type"
  std::string text;  ///< "RELIABILITY: offered best effort, asked reliable (sim_server, recorder)"
};

/// Mismatches between endpoints of different participants on the same topic. Each topic and policy
/// appears once.
std::vector<Mismatch> find_policy_mismatches(const std::vector<Endpoint>& endpoints);

/// Topics whose endpoints have types of different names, or largest samples of different sizes,
/// which shows another layout under the same name. Each topic appears once.
std::vector<Mismatch> find_type_mismatches(const std::vector<Endpoint>& endpoints);

}  // namespace sls::doctor
