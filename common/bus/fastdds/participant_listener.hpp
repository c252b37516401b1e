#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>

#include <algorithm>
#include <iterator>
#include <set>
#include <sstream>
#include <string>

#include "common/bus/fastdds/discovered_participants.hpp"
#include "common/bus/fastdds/neighbours.hpp"
#include "common/bus/fastdds/refusals.hpp"
#include "common/config/yaml_node.hpp"
#include "fastdds_discovery.hpp"

namespace sls::bus {

/// Reports discovered, accepted and refused participants to `Refusals`, and all participants and
/// endpoints to `Neighbours`, and all participants to `DiscoveredParticipants`. Our own endpoints
/// have their own listeners. To be deleted with refusals.hpp and neighbours.hpp.
class ParticipantListener : public DiscoveryListener {
 public:
  /// About the participant that this object listens to.
  struct Own {
    bool is_secured = false;
    /// Its keys do not protect submessages, so that other vendors' readers get nothing (README.md,
    /// trap 28).
    bool has_plain_submessages = false;
    bool has_shared_memory = false;
  };

  explicit ParticipantListener(const Own& own, Neighbours* neighbours = nullptr,
                               DiscoveredParticipants* discovered = nullptr)
      : own_(own), neighbours_(neighbours), discovered_(discovered) {}

  void on_participant(const dds::DomainParticipant* source, const ParticipantNews& news) override {
    const std::string guid = to_text(news.guid);
    const PeerId peer = to_peer(news.guid);
    auto& refusals = Refusals::of_process();
    if (news.kind == ParticipantNews::Kind::kGone) {
      if (neighbours_) neighbours_->drop_participant(peer);
      if (discovered_) discovered_->drop(peer);
      return refusals.note_gone(guid);
    }
    if (neighbours_)
      neighbours_->note_participant(peer, news.name, find_address(news),
                                    find_obstacle(source, news));
    if (discovered_) discovered_->note(peer, news.name, find_discovery_ports(news));
    if (news.kind != ParticipantNews::Kind::kNew) return;
    refusals.note_discovered(
        guid, describe(news),
        own_.is_secured && news.identity ? describe_identity(*news.identity) : "");
    if (own_.is_secured && !news.identity && news.is_identity_known)
      refusals.note_refused(guid, "it has no identity (its QoS file is not config/qos/secure.xml)");
    if (!own_.is_secured && news.identity)
      refusals.note_refused(guid, "it is secured, this is not (--qos config/qos/secure.xml)");
  }

  void on_endpoint(const EndpointNews& news) override {
    if (!neighbours_) return;
    Neighbours::EntityId id;
    std::copy(std::begin(news.guid.entityId.value), std::end(news.guid.entityId.value), id.begin());
    if (news.is_gone)
      neighbours_->drop_endpoint(to_peer(news.guid), id);
    else
      neighbours_->note_endpoint(to_peer(news.guid), id, news.facts);
  }

  void on_authentication(const rtps::GUID_t& participant, bool is_accepted) override {
    if (is_accepted)
      Refusals::of_process().note_accepted(to_text(participant));
    else
      Refusals::of_process().note_refused(to_text(participant));
  }

 private:
  template <class Value>
  static std::string to_text(const Value& value) {
    std::ostringstream text;
    text << value;
    return text.str();
  }

  /// 'control_client' (10.77.0.2, 01.0f.…): name, address and GUID prefix that a participant
  /// announces.
  static std::string describe(const ParticipantNews& news) {
    const std::string address = find_address(news);
    return describe_name(news.name) + " (" + address + (address.empty() ? "" : ", ") +
           to_text(news.guid.guidPrefix) + ")";
  }

  /// Why it gets no samples of ours although both are authorised; empty if there is no reason.
  std::string find_obstacle(const dds::DomainParticipant* source,
                            const ParticipantNews& news) const {
    if (own_.has_plain_submessages && news.vendor != rtps::c_VendorId_eProsima)
      return "another vendor's DDS: expected keys of ./sls keys DIR --other-vendors, got keys "
             "without it";
    const auto version = news.properties.find(kVersionProperty);
    if (!own_.has_shared_memory || version == news.properties.end() ||
        find_major(version->second) == find_major(kMiddlewareVersion) ||
        !source->guid().is_on_same_host_as(news.guid) ||
        std::none_of(news.addresses.begin(), news.addresses.end(),
                     [](const auto& locator) { return locator.kind == LOCATOR_KIND_SHM; }))
      return "";
    return "expected Fast DDS " + find_major(kMiddlewareVersion) +
           " for shared memory on one machine, got " + config::to_printable(version->second, 20) +
           " (--qos config/qos/udp.xml for both)";
  }

  /// "2" of "2.9.1".
  static std::string find_major(const std::string& version) {
    return config::to_printable(version.substr(0, version.find('.')), 20);
  }

  /// The first IPv4 address at which it receives discovery data; empty if it has none.
  static std::string find_address(const ParticipantNews& news) {
    for (const auto& locator : news.discovery_addresses)
      if (locator.kind == LOCATOR_KIND_UDPv4) return rtps::IPLocator::toIPv4string(locator);
    return "";
  }

  /// The UDP ports at which it receives discovery data.
  static std::set<int> find_discovery_ports(const ParticipantNews& news) {
    std::set<int> ports;
    for (const auto& locator : news.discovery_addresses)
      if (locator.kind == LOCATOR_KIND_UDPv4)
        ports.insert(rtps::IPLocator::getPhysicalPort(locator));
    return ports;
  }

  /// 'O=SLS, CN=…' of 'O=SLS, CN=identity authority …': certificate and authority that it claims.
  static std::string describe_identity(const ParticipantNews::Identity& identity) {
    return "'" + config::to_printable(identity.certificate, 80) + "' of '" +
           config::to_printable(identity.authority, 80) + "'";
  }

  const Own own_;
  Neighbours* const neighbours_;
  DiscoveredParticipants* const discovered_;
};

}  // namespace sls::bus
