/// Converts an endpoint of Fast DDS to `EndpointFacts`.
#pragma once

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include <algorithm>
#include <iterator>
#include <optional>

#include "common/bus/fastdds/endpoint_facts.hpp"
#include "common/bus/peer.hpp"
#include "fastdds_api.hpp"

namespace sls::bus {

inline PeerId to_peer(const rtps::GUID_t& guid) {
  PeerId peer;
  std::copy(std::begin(guid.guidPrefix.value), std::end(guid.guidPrefix.value), peer.bytes.begin());
  return peer;
}

/// The participant of an endpoint.
inline PeerId to_peer(const dds::InstanceHandle_t& endpoint) {
  rtps::GUID_t guid;
  rtps::iHandle2GUID(guid, endpoint);
  return to_peer(guid);
}

inline std::optional<std::chrono::nanoseconds> to_period(const Duration& duration) {
  if (duration == kInfinite) return std::nullopt;
  return std::chrono::nanoseconds(duration.to_ns());
}

namespace detail {

/// Fills in the policies that both writers and readers have, in this program and in others.
template <class Reliability, class Durability, class Deadline, class Liveliness, class Ownership>
void fill(EndpointFacts& facts, const Reliability& reliability, const Durability& durability,
          const Deadline& deadline, const Liveliness& liveliness, const Ownership& ownership) {
  facts.is_reliable = reliability.kind == dds::RELIABLE_RELIABILITY_QOS;
  facts.durability = static_cast<EndpointFacts::Durability>(durability.kind);
  facts.deadline = to_period(deadline.period);
  facts.liveliness = static_cast<EndpointFacts::Liveliness>(liveliness.kind);
  facts.lease = to_period(liveliness.lease_duration);
  facts.is_exclusive = ownership.kind == dds::EXCLUSIVE_OWNERSHIP_QOS;
}

}  // namespace detail

/// The facts of an endpoint of our own, which has no key.
inline EndpointFacts make_facts(const dds::DataWriter& writer) {
  EndpointFacts facts;
  facts.topic = writer.get_topic()->get_name();
  facts.type = writer.get_topic()->get_type_name();
  facts.is_writer = true;
  const auto& qos = writer.get_qos();
  detail::fill(facts, qos.reliability(), qos.durability(), qos.deadline(), qos.liveliness(),
               qos.ownership());
  return facts;
}
inline EndpointFacts make_facts(const dds::DataReader& reader) {
  EndpointFacts facts;
  facts.topic = reader.get_topicdescription()->get_name();
  facts.type = reader.get_topicdescription()->get_type_name();
  const auto& qos = reader.get_qos();
  detail::fill(facts, qos.reliability(), qos.durability(), qos.deadline(), qos.liveliness(),
               qos.ownership());
  return facts;
}

}  // namespace sls::bus
