#pragma once

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <iterator>
#include <set>
#include <sstream>
#include <string>

#include "common/bus/fastdds/discovered_participants.hpp"
#include "common/bus/fastdds/host_id.hpp"
#include "common/bus/fastdds/neighbours.hpp"
#include "common/bus/fastdds/plain_announcements.hpp"
#include "common/bus/fastdds/refusals.hpp"
#include "common/config/yaml_node.hpp"
#include "fastdds_discovery.hpp"
#include "fastdds_plain_announcements.hpp"

namespace sls::bus {

/// Reports discovered, accepted and refused participants to `Refusals`, and all participants and
/// endpoints to `Neighbours`, and all participants to `DiscoveredParticipants`. Our own endpoints
/// have their own listeners. To be deleted with refusals.hpp and neighbours.hpp.
class ParticipantListener : public DiscoveryListener {
 public:
  /// About the participant that this object listens to.
  struct Own {
    bool is_secured = false;
    /// Its keys are not for other vendors: their readers get nothing (README.md, trap 28), and Fast
    /// DDS 3 does not discover Cyclone DDS (trap 38).
    bool is_for_fastdds_alone = false;
    bool has_memory = false;  ///< it uses shared memory
  };

  explicit ParticipantListener(const Own& own, Neighbours* neighbours = nullptr,
                               DiscoveredParticipants* discovered = nullptr)
      : own_(own), neighbours_(neighbours), discovered_(discovered) {}

  /// Lets this object hear what others announce to a secured participant with these settings.
  void hear(dds::DomainParticipantQos& qos) {
    if (!own_.is_secured) return;
    hear_announcements(qos, [this](const PlainAnnouncement& other, const std::string& address) {
      if (is_self_known_ && other.sender != self_) on_announcement(other, address);
    });
  }

  /// The participant that this object listens to: until it is known, nothing is heard.
  void set_self(const PeerId& self) {
    self_ = self;
    is_self_known_ = true;
    if (neighbours_) neighbours_->set_self(self);
  }

  void on_participant(const dds::DomainParticipant*, const ParticipantNews& news) override {
    const std::string guid = to_text(news.guid);
    const PeerId peer = to_peer(news.guid);
    auto& refusals = Refusals::of_process();
    if (news.kind == ParticipantNews::Kind::kGone) {
      if (neighbours_) neighbours_->drop_participant(peer);
      if (discovered_) discovered_->drop(peer);
      return refusals.note_gone(guid);
    }
    if (neighbours_)
      neighbours_->note_participant(peer, news.name, find_address(news), find_obstacle(news));
    if (discovered_) discovered_->note(peer, news.name, find_discovery_ports(news));
    if (news.kind != ParticipantNews::Kind::kNew) return;
    const auto process = news.properties.find(kProcessProperty);
    refusals.note_discovered(
        guid, describe(news.name, find_address(news), news.guid.guidPrefix),
        own_.is_secured && news.identity ? describe_identity(*news.identity) : "",
        process == news.properties.end() ? "" : process->second);
    if (own_.is_secured && !news.identity && news.is_identity_known)
      refusals.note_refused(guid, kNoIdentity);
    if (!own_.is_secured && news.identity)
      refusals.note_refused(guid, "it is secured, this is not (--qos config/qos/secure.xml)");
    const auto version = news.properties.find(kVersionProperty);
    if (version == news.properties.end()) return;
    judge_version(guid, version->second);
    name_other_build(news, version->second);
  }

  /// Another participant announced itself from `address`, perhaps once more. Only Fast DDS 3 tells
  /// this, and only to a secured participant: it discovers no participant that it refuses.
  virtual void on_announcement(const PlainAnnouncement& other, const std::string& address) {
    rtps::GUID_t guid;
    std::copy(other.sender.bytes.begin(), other.sender.bytes.end(), guid.guidPrefix.value);
    guid.entityId = rtps::c_EntityId_RTPSParticipant;
    Refusals::of_process().note_discovered(
        to_text(guid), describe(other.name, address, guid.guidPrefix),
        other.certificate.empty() ? "" : describe_identity({other.certificate, other.authority}),
        other.process);
    if (!other.is_secured) Refusals::of_process().note_refused(to_text(guid), kNoIdentity);
    if (!other.version.empty())
      judge_version(to_text(guid), other.version);
    else if (own_.is_for_fastdds_alone && !other.as_secure.empty())
      Refusals::of_process().note_refused(to_text(guid), kOtherVendor);
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
  static constexpr const char* kNoIdentity =
      "it has no identity (its QoS file is not config/qos/secure.xml)";
  static constexpr const char* kOtherVendor =
      "another vendor's DDS: expected keys of ./sls keys DIR --other-vendors, got keys without it";

  template <class Value>
  static std::string to_text(const Value& value) {
    std::ostringstream text;
    text << value;
    return text.str();
  }

  /// 'control_client' (10.77.0.2, 01.0f.…): name, address and GUID prefix that a participant
  /// announces.
  static std::string describe(const std::string& name, const std::string& address,
                              const rtps::GuidPrefix_t& prefix) {
    return describe_name(name) + " (" + address + (address.empty() ? "" : ", ") + to_text(prefix) +
           ")";
  }

  /// Reports a participant of a version with which ours does not discover anything.
  void judge_version(const std::string& guid, const std::string& version) const {
    if (own_.is_secured &&
        has_secure_announcements(version) != has_secure_announcements(kMiddlewareVersion))
      Refusals::of_process().note_refused(
          guid, "its Fast DDS is " + config::to_printable(version, 20) + ", this one " +
                    kMiddlewareVersion + ": expected one version in a secured flight");
  }

  /// Names a program of ours once that could share memory with this one if their builds were equal.
  void name_other_build(const ParticipantNews& news, const std::string& version) {
    constexpr std::size_t kMost = 64;
    const auto build = news.properties.find(kMemoryProperty);
    if (!own_.has_memory || build == news.properties.end() ||
        build->second == std::to_string(middleware_build()) || named_.size() >= kMost ||
        !named_.insert(news.name).second)
      return;
    spdlog::info(
        "{} uses another build of Fast DDS ({}, here {}): UDP between them, no shared memory",
        describe_name(news.name), config::to_printable(version, 20), kMiddlewareVersion);
  }

  /// Why it gets no samples of ours although both are authorised; empty if there is no reason.
  std::string find_obstacle(const ParticipantNews& news) const {
    return own_.is_for_fastdds_alone && news.vendor != rtps::c_VendorId_eProsima ? kOtherVendor
                                                                                 : "";
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
  std::set<std::string> named_;  // programs of other builds
  PeerId self_;
  std::atomic<bool> is_self_known_{false};
  Neighbours* const neighbours_;
  DiscoveredParticipants* const discovered_;
};

}  // namespace sls::bus
