/// Converts an endpoint of Fast DDS to `EndpointFacts`.
#pragma once

#include <fastdds/rtps/common/Guid.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/rtps/common/EntityId_t.hpp>

#include <algorithm>
#include <iterator>
#include <optional>
#include <string>

#include "common/bus/fastdds/endpoint_facts.hpp"
#include "common/bus/peer.hpp"

namespace sls::bus {

inline PeerId to_peer(const eprosima::fastrtps::rtps::GUID_t& guid) {
  PeerId peer;
  std::copy(std::begin(guid.guidPrefix.value), std::end(guid.guidPrefix.value), peer.bytes.begin());
  return peer;
}

inline std::optional<std::chrono::nanoseconds> to_period(
    const eprosima::fastrtps::Duration_t& duration) {
  if (duration == eprosima::fastrtps::c_TimeInfinite) return std::nullopt;
  return std::chrono::nanoseconds(duration.to_ns());
}

namespace detail {

/// Fills in the policies that both writers and readers have, in this program and in others.
template <class Reliability, class Durability, class Deadline, class Liveliness, class Ownership>
void fill(EndpointFacts& facts, const Reliability& reliability, const Durability& durability,
          const Deadline& deadline, const Liveliness& liveliness, const Ownership& ownership) {
  facts.is_reliable = reliability.kind == eprosima::fastdds::dds::RELIABLE_RELIABILITY_QOS;
  facts.durability = static_cast<EndpointFacts::Durability>(durability.kind);
  facts.deadline = to_period(deadline.period);
  facts.liveliness = static_cast<EndpointFacts::Liveliness>(liveliness.kind);
  facts.lease = to_period(liveliness.lease_duration);
  facts.is_exclusive = ownership.kind == eprosima::fastdds::dds::EXCLUSIVE_OWNERSHIP_QOS;
}

}  // namespace detail

/// The facts of an endpoint of another participant. `Proxy` is the type of its announcement.
template <class Proxy>
EndpointFacts make_facts(const Proxy& proxy) {
  EndpointFacts facts;
  facts.topic = proxy.topicName().to_string();
  facts.type = proxy.typeName().to_string();
  facts.is_writer = std::is_same_v<Proxy, eprosima::fastrtps::rtps::WriterProxyData>;
  facts.is_keyed = proxy.topicKind() == eprosima::fastrtps::rtps::WITH_KEY;
  const auto& qos = proxy.m_qos;
  detail::fill(facts, qos.m_reliability, qos.m_durability, qos.m_deadline, qos.m_liveliness,
               qos.m_ownership);
  for (const auto id : qos.representation.m_value) facts.representations.push_back(id);
  for (const std::string& name : qos.m_partition.names()) facts.partitions.push_back(name);
  return facts;
}

/// The facts of an endpoint of our own, which has no key.
inline EndpointFacts make_facts(const eprosima::fastdds::dds::DataWriter& writer) {
  EndpointFacts facts;
  facts.topic = writer.get_topic()->get_name();
  facts.type = writer.get_topic()->get_type_name();
  facts.is_writer = true;
  const auto& qos = writer.get_qos();
  detail::fill(facts, qos.reliability(), qos.durability(), qos.deadline(), qos.liveliness(),
               qos.ownership());
  return facts;
}
inline EndpointFacts make_facts(const eprosima::fastdds::dds::DataReader& reader) {
  EndpointFacts facts;
  facts.topic = reader.get_topicdescription()->get_name();
  facts.type = reader.get_topicdescription()->get_type_name();
  const auto& qos = reader.get_qos();
  detail::fill(facts, qos.reliability(), qos.durability(), qos.deadline(), qos.liveliness(),
               qos.ownership());
  return facts;
}

}  // namespace sls::bus
