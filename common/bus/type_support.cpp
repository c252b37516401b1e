/// The type supports of idl/sls.idl, which serialise its types.
#include "common/bus/fastdds/guarded_type.hpp"
#include "common/bus/node.hpp"

namespace sls::bus {
namespace {

template <class Support, class Message>
bool decode_by(const std::vector<std::uint8_t>& cdr, Message& message) {
  Support support;
  rtps::SerializedPayload_t payload;
  payload.data = const_cast<std::uint8_t*>(cdr.data());  // it is only read
  payload.length = static_cast<std::uint32_t>(cdr.size());
  const bool is_decoded = deserialize(support, payload, &message);
  payload.data = nullptr;  // the payload must not free it
  return is_decoded;
}

}  // namespace

template <>
bool decode(const std::vector<std::uint8_t>& cdr, States& message) {
  return decode_by<GuardedType<StatesPubSubType>>(cdr, message);
}
template <>
bool decode(const std::vector<std::uint8_t>& cdr, Commands& message) {
  return decode_by<GuardedType<CommandsPubSubType>>(cdr, message);
}
template <>
bool decode(const std::vector<std::uint8_t>& cdr, RecordBatch& message) {
  return decode_by<GuardedType<RecordBatchPubSubType>>(cdr, message);
}

}  // namespace sls::bus

namespace sls::bus::detail {

template <>
void* make_type_support<States>() {
  return static_cast<dds::TopicDataType*>(new GuardedType<StatesPubSubType>);
}
template <>
void* make_type_support<Commands>() {
  return static_cast<dds::TopicDataType*>(new GuardedType<CommandsPubSubType>);
}
template <>
void* make_type_support<RecordBatch>() {
  return static_cast<dds::TopicDataType*>(new GuardedType<RecordBatchPubSubType>);
}
template <>
void* make_type_support<Participant>() {
  return static_cast<dds::TopicDataType*>(new GuardedType<ParticipantPubSubType>);
}
template <>
void* make_type_support<Parameters>() {
  return static_cast<dds::TopicDataType*>(new GuardedType<ParametersPubSubType>);
}
template <>
void* make_type_support<SimStatus>() {
  return static_cast<dds::TopicDataType*>(new GuardedType<SimStatusPubSubType>);
}
template <>
void* make_type_support<SimControl>() {
  return static_cast<dds::TopicDataType*>(new GuardedType<SimControlPubSubType>);
}
template <>
void* make_type_support<SimControlReply>() {
  return static_cast<dds::TopicDataType*>(new GuardedType<SimControlReplyPubSubType>);
}

}  // namespace sls::bus::detail
