#include "tools/doctor/settings.hpp"

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>

#include <algorithm>

#include "common/bus/node.hpp"
#include "common/bus/qos_file.hpp"
#include "common/bus/security_files.hpp"
#include "common/bus/topics.hpp"
#include "fastdds_api.hpp"
#include "tools/doctor/file_qos.hpp"

namespace sls::doctor {
namespace {

namespace dds = bus::dds;
namespace rtps = bus::rtps;
using rtps::SharedMemTransportDescriptor;
using rtps::UDPTransportDescriptor;

bool is_multicast(const rtps::Locator_t& locator) { return rtps::IPLocator::isMulticast(locator); }

}  // namespace

dds::DomainParticipantQos load_participant_qos(const std::filesystem::path& qos_file,
                                               const std::string& identity) {
  bus::load_profiles(qos_file, identity);
  dds::DomainParticipantQos qos;
  dds::DomainParticipantFactory::get_instance()->get_participant_qos_from_profile(
      bus::kParticipantProfile, qos);
  return qos;
}

bool is_secured(const dds::DomainParticipantQos& qos) {
  return rtps::PropertyPolicyHelper::find_property(qos.properties(), "dds.sec.auth.plugin") !=
         nullptr;
}

Ports find_ports(const dds::DomainParticipantQos& qos, int domain) {
  const auto& port = qos.wire_protocol().port;
  return {port.portBase, port.domainIDGain, port.participantIDGain, domain};
}

bool uses_default_multicast(const dds::DomainParticipantQos& qos) {
  const auto& builtin = qos.wire_protocol().builtin;
  return builtin.discovery_config.discoveryProtocol == rtps::DiscoveryProtocol::SIMPLE &&
         builtin.initialPeersList.empty();
}

bool Settings::is_local() const {
  return !only_addresses.empty() &&
         std::all_of(only_addresses.begin(), only_addresses.end(),
                     [](const std::string& address) { return address.rfind("127.", 0) == 0; });
}

Settings load_settings(const std::filesystem::path& qos_file, int domain,
                       const std::string& identity) {
  const auto qos = load_participant_qos(qos_file, identity);
  Settings settings;
  settings.ports = find_ports(qos, domain);
  const auto note_shared_memory = [&](const SharedMemTransportDescriptor& transport) {
    settings.uses_shared_memory = true;
    settings.segment_size = transport.segment_size();
  };
  if (qos.transport().use_builtin_transports) note_shared_memory(SharedMemTransportDescriptor());
  for (const auto& transport : qos.transport().user_transports) {
    if (const auto* udp = dynamic_cast<const UDPTransportDescriptor*>(transport.get()))
      settings.only_addresses = udp->interfaceWhiteList;
    if (const auto* memory = dynamic_cast<const SharedMemTransportDescriptor*>(transport.get()))
      note_shared_memory(*memory);
  }
  const auto& builtin = qos.wire_protocol().builtin;
  const auto& peers = builtin.initialPeersList;
  settings.uses_multicast =
      uses_default_multicast(qos) ||
      std::any_of(peers.begin(), peers.end(), [](const auto& peer) { return is_multicast(peer); });
  for (const auto& locator : bus::find_discovery_servers(qos))
    settings.discovery_servers.push_back(rtps::IPLocator::ip_to_string(locator) + ":" +
                                         std::to_string(locator.port));
  settings.is_secured = is_secured(qos);
  settings.expiry = bus::check_security_files(bus::read_qos_file(qos_file, identity)).expiry;
  return settings;
}

}  // namespace sls::doctor
