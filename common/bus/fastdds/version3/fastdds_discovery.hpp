/// News of Fast DDS 3 about discovered participants and endpoints; version2/ has the same for Fast
/// DDS 2.
#pragma once

#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/rtps/builtin/data/ParticipantBuiltinTopicData.hpp>
#include <fastdds/rtps/builtin/data/PublicationBuiltinTopicData.hpp>
#include <fastdds/rtps/builtin/data/SubscriptionBuiltinTopicData.hpp>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.hpp>
#include <fastdds/rtps/reader/ReaderDiscoveryStatus.hpp>
#include <fastdds/rtps/writer/WriterDiscoveryStatus.hpp>

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
                                rtps::ParticipantDiscoveryStatus status,
                                const rtps::ParticipantBuiltinTopicData& data, bool&) final {
    using Kind = ParticipantNews::Kind;
    using Status = rtps::ParticipantDiscoveryStatus;
    ParticipantNews news;
    news.kind = status == Status::DISCOVERED_PARTICIPANT    ? Kind::kNew
                : status == Status::CHANGED_QOS_PARTICIPANT ? Kind::kChanged
                                                            : Kind::kGone;
    news.guid = data.guid;
    news.name = data.participant_name.to_string();
    news.vendor = data.vendor_id;
    auto& properties = const_cast<dds::ParameterPropertyList_t&>(data.properties);  // no const find
    for (auto at = properties.begin(); at != properties.end(); ++at)
      news.properties.emplace(at->first(), at->second());
    const auto& discovery = data.metatraffic_locators.unicast;
    news.discovery_addresses.assign(discovery.begin(), discovery.end());
    const auto& user = data.default_locators.unicast;
    news.addresses.assign(user.begin(), user.end());
    // The middleware does not tell the identity token.
    const auto certificate = news.properties.find(kCertificateProperty);
    if (certificate != news.properties.end())
      news.identity = {certificate->second, news.properties[kAuthorityProperty]};
    news.is_identity_known = news.identity || news.properties.count(kVersionProperty) > 0;
    on_participant(source, news);
  }

  void on_data_writer_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryStatus status,
                                const rtps::PublicationBuiltinTopicData& data, bool&) final {
    on_endpoint(make_news(data, status == rtps::WriterDiscoveryStatus::REMOVED_WRITER, true,
                          data.max_serialized_size));
  }
  void on_data_reader_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryStatus status,
                                const rtps::SubscriptionBuiltinTopicData& data, bool&) final {
    on_endpoint(make_news(data, status == rtps::ReaderDiscoveryStatus::REMOVED_READER, false, 0));
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
    news.guid = data.guid;
    news.max_size = max_size;
    EndpointFacts& facts = news.facts;
    facts.topic = data.topic_name.to_string();
    facts.type = data.type_name.to_string();
    facts.is_writer = is_writer;
    facts.is_keyed = data.topic_kind == rtps::WITH_KEY;
    detail::fill(facts, data.reliability, data.durability, data.deadline, data.liveliness,
                 data.ownership);
    for (const auto id : data.representation.m_value) facts.representations.push_back(id);
    for (const std::string& name : data.partition.names()) facts.partitions.push_back(name);
    return news;
  }
};

}  // namespace sls::bus
