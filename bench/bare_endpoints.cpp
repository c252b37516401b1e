#include "bench/bare_endpoints.hpp"

namespace sls::bench {

BareNode::BareNode(const std::filesystem::path& qos_file, int domain, const std::string& identity) {
  bus::load_profiles(qos_file, identity);
  auto* factory = dds::DomainParticipantFactory::get_instance();
  dds::DomainParticipantQos qos;
  factory->get_participant_qos_from_profile(bus::kParticipantProfile, qos);
  participant = factory->create_participant(static_cast<std::uint32_t>(domain), qos);
  if (!participant) throw bus::BusError("domain " + std::to_string(domain) + ": cannot join");
  publisher = participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  subscriber = participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
}

BareNode::~BareNode() {
  if (!participant) return;
  participant->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
}

dds::Topic* BareNode::create_topic(const char* name, dds::TypeSupport type) {
  bus::leave_out_type_object(type);
  type.register_type(participant);
  return participant->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
}

}  // namespace sls::bench
