/// The type supports of idl/sls.idl: what serialises each type.
#include <fastdds/dds/topic/TopicDataType.hpp>

#include "common/bus/fastdds/guarded_type.hpp"
#include "common/bus/node.hpp"

namespace sls::bus::detail {

template <>
void* make_type_support<VehicleState>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(
      new GuardedType<VehicleStatePubSubType>);
}
template <>
void* make_type_support<ControlCommand>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(
      new GuardedType<ControlCommandPubSubType>);
}
template <>
void* make_type_support<Reference>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(new GuardedType<ReferencePubSubType>);
}
template <>
void* make_type_support<FleetState>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(new GuardedType<FleetStatePubSubType>);
}
template <>
void* make_type_support<FleetCommand>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(
      new GuardedType<FleetCommandPubSubType>);
}
template <>
void* make_type_support<FleetReference>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(
      new GuardedType<FleetReferencePubSubType>);
}
template <>
void* make_type_support<Participant>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(
      new GuardedType<ParticipantPubSubType>);
}
template <>
void* make_type_support<Parameters>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(new GuardedType<ParametersPubSubType>);
}
template <>
void* make_type_support<SimStatus>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(new GuardedType<SimStatusPubSubType>);
}
template <>
void* make_type_support<SimControl>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(new GuardedType<SimControlPubSubType>);
}
template <>
void* make_type_support<SimControlReply>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(
      new GuardedType<SimControlReplyPubSubType>);
}

}  // namespace sls::bus::detail
