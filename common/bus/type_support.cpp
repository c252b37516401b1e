/// The type supports of idl/sls.idl: what serialises each type.
#include <fastdds/dds/topic/TopicDataType.hpp>

#include "common/bus/fastdds/guarded_type.hpp"
#include "common/bus/node.hpp"

namespace sls::bus::detail {

template <>
void* make_type_support<States>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(new GuardedType<StatesPubSubType>);
}
template <>
void* make_type_support<Commands>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(new GuardedType<CommandsPubSubType>);
}
template <>
void* make_type_support<RecordBatch>() {
  return static_cast<eprosima::fastdds::dds::TopicDataType*>(
      new GuardedType<RecordBatchPubSubType>);
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
