/// News of Fast DDS 2 about discovered participants and endpoints; version3/ has the same for Fast
/// DDS 3.
#pragma once

#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>

#include <string>

#include "common/bus/fastdds/discovery.hpp"
#include "common/bus/fastdds/facts_of.hpp"

namespace sls::bus {

/// Passes news on, on threads of the middleware.
class DiscoveryListener : public dds::DomainParticipantListener {
 public:
  /// `source`: the participant of ours that has discovered the other one.
  virtual void on_participant(const dds::DomainParticipant* source,
                              const ParticipantNews& news) = 0;
  virtual void on_endpoint(const EndpointNews& news) = 0;
  virtual void on_authentication(const rtps::GUID_t& participant, bool is_accepted) = 0;

 private:
  void on_participant_discovery(dds::DomainParticipant* source,
                                rtps::ParticipantDiscoveryInfo&& info) final {
    using Kind = ParticipantNews::Kind;
    auto& data =
        const_cast<rtps::ParticipantProxyData&>(info.info);  // its properties: no const find
    ParticipantNews news;
    news.kind = info.status == info.DISCOVERED_PARTICIPANT    ? Kind::kNew
                : info.status == info.CHANGED_QOS_PARTICIPANT ? Kind::kChanged
                                                              : Kind::kGone;
    news.guid = data.m_guid;
    news.name = data.m_participantName.to_string();
    news.vendor = data.m_VendorId;
    for (auto at = data.m_properties.begin(); at != data.m_properties.end(); ++at)
      news.properties.emplace(at->first(), at->second());
    const auto& discovery = data.metatraffic_locators.unicast;
    news.discovery_addresses.assign(discovery.begin(), discovery.end());
    const auto& user = data.default_locators.unicast;
    news.addresses.assign(user.begin(), user.end());
    if (!data.identity_token_.class_id().empty()) {
      news.identity.emplace();
      for (const auto& property : data.identity_token_.properties()) {
        if (property.name() == "dds.cert.sn") news.identity->certificate = property.value();
        if (property.name() == "dds.ca.sn") news.identity->authority = property.value();
      }
    }
    on_participant(source, news);
  }

  void on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) final {
    on_endpoint(make_news(info.info, info.status == info.REMOVED_WRITER, true,
                          info.info.typeMaxSerialized()));
  }
  void on_subscriber_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryInfo&& info) final {
    on_endpoint(make_news(info.info, info.status == info.REMOVED_READER, false, 0));
  }

  void onParticipantAuthentication(dds::DomainParticipant*,
                                   rtps::ParticipantAuthenticationInfo&& info) final {
    on_authentication(info.guid, info.status == info.AUTHORIZED_PARTICIPANT);
  }

  template <class Data>
  static EndpointNews make_news(const Data& data, bool is_gone, bool is_writer,
                                std::uint32_t max_size) {
    EndpointNews news;
    news.is_gone = is_gone;
    news.guid = data.guid();
    news.max_size = max_size;
    EndpointFacts& facts = news.facts;
    facts.topic = data.topicName().to_string();
    facts.type = data.typeName().to_string();
    facts.is_writer = is_writer;
    facts.is_keyed = data.topicKind() == rtps::WITH_KEY;
    const auto& qos = data.m_qos;
    detail::fill(facts, qos.m_reliability, qos.m_durability, qos.m_deadline, qos.m_liveliness,
                 qos.m_ownership);
    for (const auto id : qos.representation.m_value) facts.representations.push_back(id);
    for (const std::string& name : qos.m_partition.names()) facts.partitions.push_back(name);
    return news;
  }
};

}  // namespace sls::bus
