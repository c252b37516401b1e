#pragma once

#include <fastrtps/utils/IPLocator.h>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>

#include <sstream>
#include <string>

#include "common/bus/fastdds/refusals.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::bus {

/// Tells `Refusals` who was discovered, accepted and refused. Endpoints have listeners of their
/// own. To be deleted with refusals.hpp.
class ParticipantListener : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  /// `is_secured`: whether this participant is.
  explicit ParticipantListener(bool is_secured) : is_secured_(is_secured) {}

  void on_participant_discovery(
      eprosima::fastdds::dds::DomainParticipant*,
      eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override {
    using Info = eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;
    const std::string guid = to_text(info.info.m_guid);
    auto& refusals = Refusals::of_process();
    if (info.status == Info::DROPPED_PARTICIPANT || info.status == Info::REMOVED_PARTICIPANT)
      return refusals.note_gone(guid);
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
  template <class Value>
  static std::string to_text(const Value& value) {
    std::ostringstream text;
    text << value;
    return text.str();
  }

  /// 'control_client' (10.77.0.2, 01.0f.…): what a participant says of itself.
  static std::string describe(const eprosima::fastrtps::rtps::ParticipantProxyData& participant) {
    std::string address;
    for (const auto& locator : participant.metatraffic_locators.unicast)
      if (locator.kind == LOCATOR_KIND_UDPv4 && address.empty())
        address = eprosima::fastrtps::rtps::IPLocator::toIPv4string(locator) + ", ";
    return "'" + config::to_printable(participant.m_participantName.to_string()) + "' (" + address +
           to_text(participant.m_guid.guidPrefix) + ")";
  }

  /// 'O=SLS, CN=…' of 'O=SLS, CN=identity authority …': what it says of its identity.
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
};

}  // namespace sls::bus
