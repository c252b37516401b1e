#include "common/bus/fastdds/guarded_transports.hpp"

#include <spdlog/spdlog.h>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/qos/DomainParticipantFactoryQos.hpp>
#include <memory>
#include <mutex>
#include <string>

#include "common/bus/fastdds/datagram_guard.hpp"
#include "common/bus/fastdds/host_id.hpp"
#include "fastdds_chaining.hpp"

namespace sls::bus {
namespace {

using Receiver = rtps::TransportReceiverInterface;

/// A transport on top of another one.
class ChainedTransport : public SendingTransport {
 public:
  using SendingTransport::SendingTransport;

  rtps::TransportDescriptorInterface* get_configuration() override {
    return low_level_transport_->get_configuration();
  }

  /// One channel sends to all addresses. The transport below does not recognise its own channel
  /// inside ours: it opens another one for each address, which is closed again. Otherwise each
  /// message would go out as often. The transport needs each address all the same (statistics).
  bool OpenOutputChannel(rtps::SendResourceList& channels,
                         const rtps::Locator_t& address) override {
    rtps::SendResourceList others;
    if (is_open_) return low_level_transport_->OpenOutputChannel(others, address);
    is_open_ = ChainingTransport::OpenOutputChannel(channels, address);
    return is_open_;
  }

 private:
  bool is_open_ = false;
};

class GuardedUdp : public ChainedTransport {
 public:
  using ChainedTransport::ChainedTransport;

  void receive(Receiver* next, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    const DatagramVerdict verdict = judge_datagram(data, size);
    if (!verdict.defect) {
      next->OnDataReceived(data, static_cast<std::uint32_t>(verdict.bytes), local, remote);
      return;
    }
    static RefusedDatagrams refused;
    const std::string address = rtps::IPLocator::toIPv4string(remote);
    if (refused.note(address))
      spdlog::warn("{}: expected RTPS messages, got {}: refuses such datagrams", address,
                   verdict.defect);
  }
};

class OwnMemory : public ChainedTransport {
 public:
  using ChainedTransport::ChainedTransport;

  void receive(Receiver* next, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    next->OnDataReceived(data, size, local, remote);
  }
  bool getDefaultMetatrafficMulticastLocators(rtps::LocatorList_t& list,
                                              std::uint32_t port) const override {
    return low_level_transport_->getDefaultMetatrafficMulticastLocators(list,
                                                                        make_memory_port(port));
  }
  bool getDefaultMetatrafficUnicastLocators(rtps::LocatorList_t& list,
                                            std::uint32_t port) const override {
    return low_level_transport_->getDefaultMetatrafficUnicastLocators(list, make_memory_port(port));
  }
  bool getDefaultUnicastLocators(rtps::LocatorList_t& list, std::uint32_t port) const override {
    return low_level_transport_->getDefaultUnicastLocators(list, make_memory_port(port));
  }
};

struct Below : rtps::ChainingTransportDescriptor {
  using ChainingTransportDescriptor::ChainingTransportDescriptor;
  rtps::TransportInterface* create_transport() const override {
    return low_level_descriptor->create_transport();
  }
};

/// Describes a `Transport` on top of one that `Descriptor` describes. It stays a `Descriptor`,
/// because Fast DDS asks for its kind.
template <class Descriptor, class Transport>
struct Guarded : Descriptor {
  Guarded(const Descriptor& below, std::uint32_t most) : Descriptor(below), most_sent(most) {}
  rtps::TransportInterface* create_transport() const override {
    return new Transport(Below(std::make_shared<Descriptor>(*this)));
  }
  std::uint32_t max_message_size() const override {
    return most_sent > 0 ? most_sent : Descriptor::max_message_size();
  }
  std::uint32_t most_sent;
};

using Udp = rtps::UDPv4TransportDescriptor;
using Memory = rtps::SharedMemTransportDescriptor;

TransportDescriptor guard(const TransportDescriptor& transport, std::uint32_t most_sent) {
  if (const auto* udp = dynamic_cast<const Udp*>(transport.get()))
    return std::make_shared<Guarded<Udp, GuardedUdp>>(*udp, most_sent);
  if (const auto* memory = dynamic_cast<const Memory*>(transport.get()))
    return std::make_shared<Guarded<Memory, OwnMemory>>(*memory, 0);
  // One that hears announcements is on top of another one (plain_announcements.hpp).
  if (auto* chained = dynamic_cast<rtps::ChainingTransportDescriptor*>(transport.get()))
    chained->low_level_descriptor = guard(chained->low_level_descriptor, most_sent);
  return transport;
}

}  // namespace

dds::DomainParticipant* create_participant(int domain, dds::DomainParticipantQos qos,
                                           dds::DomainParticipantListener* listener,
                                           std::uint32_t most_sent) {
  auto& transports = qos.transport();
  auto& own = transports.user_transports;
  if (transports.use_builtin_transports) {
    own.push_back(std::make_shared<Udp>());
    own.push_back(std::make_shared<Memory>());
    transports.use_builtin_transports = false;
  }
  for (TransportDescriptor& transport : own) transport = guard(transport, most_sent);

  static std::mutex mutex;  // guards the factory's QoS
  const std::lock_guard lock(mutex);
  auto* factory = dds::DomainParticipantFactory::get_instance();
  dds::DomainParticipantFactoryQos usual;
  factory->get_qos(usual);
  dds::DomainParticipantFactoryQos disabled = usual;
  disabled.entity_factory().autoenable_created_entities = false;
  factory->set_qos(disabled);
  auto* participant = factory->create_participant(static_cast<std::uint32_t>(domain), qos, listener,
                                                  dds::StatusMask::none());
  factory->set_qos(usual);
  if (!participant) return nullptr;
  if (!mark_host())
    spdlog::warn(
        "Fast DDS {}: its number of this host cannot be changed: beside programs with another "
        "build of Fast DDS use config/qos/udp.xml",
        kMiddlewareVersion);
  if (is_ok(participant->enable())) return participant;
  factory->delete_participant(participant);
  return nullptr;
}

std::uint32_t make_memory_port(std::uint32_t port) {
  return port | static_cast<std::uint32_t>(middleware_build()) << 16;
}

}  // namespace sls::bus
