#pragma once

#include <fastrtps/utils/IPLocator.h>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>

#include <algorithm>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "common/bus/fastdds/discovered_participants.hpp"
#include "common/bus/fastdds/facts_of.hpp"
#include "common/bus/fastdds/neighbours.hpp"
#include "common/bus/fastdds/refusals.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::bus {

/// Reports discovered, accepted and refused participants to `Refusals`, and all participants and
/// endpoints to `Neighbours`, and all participants to `DiscoveredParticipants`. Our own endpoints
/// have their own listeners. To be deleted with refusals.hpp and neighbours.hpp.
class ParticipantListener : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  /// `is_secured`: true if this participant uses DDS Security; `has_plain_submessages`: and if its
  /// keys do not protect submessages, so that other vendors' readers get nothing (README.md, trap
  /// 28).
  explicit ParticipantListener(bool is_secured, Neighbours* neighbours = nullptr,
                               DiscoveredParticipants* discovered = nullptr,
                               bool has_plain_submessages = false)
      : is_secured_(is_secured),
        has_plain_submessages_(has_plain_submessages),
        neighbours_(neighbours),
        discovered_(discovered) {}

  void on_participant_discovery(
      eprosima::fastdds::dds::DomainParticipant*,
      eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override {
    using Info = eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;
    const std::string guid = to_text(info.info.m_guid);
    const PeerId peer = to_peer(info.info.m_guid);
    auto& refusals = Refusals::of_process();
    if (info.status == Info::DROPPED_PARTICIPANT || info.status == Info::REMOVED_PARTICIPANT) {
      if (neighbours_) neighbours_->drop_participant(peer);
      if (discovered_) discovered_->drop(peer);
      return refusals.note_gone(guid);
    }
    if (neighbours_)
      neighbours_->note_participant(peer, info.info.m_participantName.to_string(),
                                    find_address(info.info), find_obstacle(info.info));
    if (discovered_)
      discovered_->note(peer, info.info.m_participantName.to_string(),
                        find_discovery_ports(info.info));
    if (info.status != Info::DISCOVERED_PARTICIPANT) return;
    const auto& token = info.info.identity_token_;
    const bool is_other_secured = !token.class_id().empty();
    refusals.note_discovered(guid, describe(info.info),
                             is_secured_ && is_other_secured ? describe_identity(token) : "");
    if (is_secured_ && !is_other_secured)
      refusals.note_refused(guid, "it has no identity (its QoS file is not config/qos/secure.xml)");
    if (!is_secured_ && is_other_secured)
      refusals.note_refused(guid, "it is secured, this is not (--qos config/qos/secure.xml)");
  }

  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant*,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override {
    note_endpoint(info, info.REMOVED_WRITER);
  }
  void on_subscriber_discovery(eprosima::fastdds::dds::DomainParticipant*,
                               eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& info) override {
    note_endpoint(info, info.REMOVED_READER);
  }

  void onParticipantAuthentication(
      eprosima::fastdds::dds::DomainParticipant*,
      eprosima::fastrtps::rtps::ParticipantAuthenticationInfo&& info) override {
    using Info = eprosima::fastrtps::rtps::ParticipantAuthenticationInfo;
    if (info.status == Info::AUTHORIZED_PARTICIPANT)
      Refusals::of_process().note_accepted(to_text(info.guid));
    else
      Refusals::of_process().note_refused(to_text(info.guid));
  }

 private:
  template <class Info, class Status>
  void note_endpoint(const Info& info, Status removed) {
    if (!neighbours_) return;
    const auto& guid = info.info.guid();
    Neighbours::EntityId id;
    std::copy(std::begin(guid.entityId.value), std::end(guid.entityId.value), id.begin());
    if (info.status == removed)
      neighbours_->drop_endpoint(to_peer(guid), id);
    else
      neighbours_->note_endpoint(to_peer(guid), id, make_facts(info.info));
  }

  template <class Value>
  static std::string to_text(const Value& value) {
    std::ostringstream text;
    text << value;
    return text.str();
  }

  /// 'control_client' (10.77.0.2, 01.0f.…): name, address and GUID prefix that a participant
  /// announces.
  static std::string describe(const eprosima::fastrtps::rtps::ParticipantProxyData& participant) {
    const std::string address = find_address(participant);
    return describe_name(participant.m_participantName.to_string()) + " (" + address +
           (address.empty() ? "" : ", ") + to_text(participant.m_guid.guidPrefix) + ")";
  }

  /// Why it gets no samples of ours although both are authorised; empty if there is no reason.
  std::string find_obstacle(
      const eprosima::fastrtps::rtps::ParticipantProxyData& participant) const {
    const bool is_of_other_vendor =
        participant.m_VendorId != eprosima::fastrtps::rtps::c_VendorId_eProsima;
    return has_plain_submessages_ && is_of_other_vendor
               ? "another vendor's DDS: expected keys of ./sls keys DIR --other-vendors, got keys "
                 "without it"
               : "";
  }

  /// The first IPv4 address at which it receives discovery data; empty if it has none.
  static std::string find_address(
      const eprosima::fastrtps::rtps::ParticipantProxyData& participant) {
    for (const auto& locator : participant.metatraffic_locators.unicast)
      if (locator.kind == LOCATOR_KIND_UDPv4)
        return eprosima::fastrtps::rtps::IPLocator::toIPv4string(locator);
    return "";
  }

  /// The UDP ports at which it receives discovery data.
  static std::set<int> find_discovery_ports(
      const eprosima::fastrtps::rtps::ParticipantProxyData& participant) {
    std::set<int> ports;
    for (const auto& locator : participant.metatraffic_locators.unicast)
      if (locator.kind == LOCATOR_KIND_UDPv4)
        ports.insert(eprosima::fastrtps::rtps::IPLocator::getPhysicalPort(locator));
    return ports;
  }

  /// 'O=SLS, CN=…' of 'O=SLS, CN=identity authority …': certificate and authority that it claims.
  template <class Token>
  static std::string describe_identity(const Token& token) {
    std::string certificate, authority;
    for (const auto& property : token.properties()) {
      if (property.name() == "dds.cert.sn") certificate = property.value();
      if (property.name() == "dds.ca.sn") authority = property.value();
    }
    return "'" + config::to_printable(certificate, 80) + "' of '" +
           config::to_printable(authority, 80) + "'";
  }

  const bool is_secured_;
  const bool has_plain_submessages_;
  Neighbours* const neighbours_;
  DiscoveredParticipants* const discovered_;
};

}  // namespace sls::bus
