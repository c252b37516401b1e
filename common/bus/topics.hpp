/// The topics of idl/sls.idl: name and QoS profiles of each type. Table: idl/README.md.
#pragma once

#include <sls.h>  // generated from idl/sls.idl

#include <cstddef>

namespace sls::bus {

/// SHA-256 of idl/sls.idl without comments and with white space collapsed: idl/README.md. Samples
/// of a program built from another contract are ignored.
inline constexpr const char* kContractSha256 = SLS_CONTRACT_SHA256;

/// The purpose of a topic decides its QoS profiles: config/qos/README.md.
enum class Flow {
  kLoop,     ///< the control loop: states and commands, one step at a time
  kRecord,   ///< batches of steps for recorders
  kLatched,  ///< data that a late joiner requires: participant, parameters, status. Also control:
             ///< its requests carry a run_id, so they cannot act on a later run
};

/// Profile names in a QoS file.
inline constexpr const char* kParticipantProfile = "sls_participant";
inline constexpr const char* kLoopWriterProfile = "sls_loop_writer";
inline constexpr const char* kLoopReaderProfile = "sls_loop_reader";
inline constexpr const char* kRecordWriterProfile = "sls_record_writer";
inline constexpr const char* kRecordReaderProfile = "sls_record_reader";
inline constexpr const char* kLatchedWriterProfile = "sls_latched_writer";
inline constexpr const char* kLatchedReaderProfile = "sls_latched_reader";
/// sls/command in real time, with DEADLINE and LIFESPAN. These profiles are optional: without them
/// sls/command has neither.
inline constexpr const char* kRealtimeCommandWriterProfile = "sls_realtime_command_writer";
inline constexpr const char* kRealtimeCommandReaderProfile = "sls_realtime_command_reader";

/// Writer profile of a flow.
constexpr const char* find_writer_profile(Flow flow) {
  return flow == Flow::kLoop     ? kLoopWriterProfile
         : flow == Flow::kRecord ? kRecordWriterProfile
                                 : kLatchedWriterProfile;
}

/// The topics by number, in the order of kTopicNames.
enum class TopicId {
  kState,
  kCommand,
  kRecord,
  kParticipant,
  kParameters,
  kStatus,
  kControl,
  kControlReply
};
inline constexpr std::size_t kTopics = 8;

/// `kId`, `kName` and `kFlow` of the topic that carries `Message`.
template <class Message>
struct Topic;

template <>
struct Topic<States> {
  static constexpr TopicId kId = TopicId::kState;
  static constexpr const char* kName = "sls/state";
  static constexpr Flow kFlow = Flow::kLoop;
};
template <>
struct Topic<Commands> {
  static constexpr TopicId kId = TopicId::kCommand;
  static constexpr const char* kName = "sls/command";
  static constexpr Flow kFlow = Flow::kLoop;
};
template <>
struct Topic<RecordBatch> {
  static constexpr TopicId kId = TopicId::kRecord;
  static constexpr const char* kName = "sls/record";
  static constexpr Flow kFlow = Flow::kRecord;
};
template <>
struct Topic<Participant> {
  static constexpr TopicId kId = TopicId::kParticipant;
  static constexpr const char* kName = "sls/participant";
  static constexpr Flow kFlow = Flow::kLatched;
};
template <>
struct Topic<Parameters> {
  static constexpr TopicId kId = TopicId::kParameters;
  static constexpr const char* kName = "sls/parameters";
  static constexpr Flow kFlow = Flow::kLatched;
};
template <>
struct Topic<SimStatus> {
  static constexpr TopicId kId = TopicId::kStatus;
  static constexpr const char* kName = "sls/status";
  static constexpr Flow kFlow = Flow::kLatched;
};
template <>
struct Topic<SimControl> {
  static constexpr TopicId kId = TopicId::kControl;
  static constexpr const char* kName = "sls/control";
  static constexpr Flow kFlow = Flow::kLatched;
};
template <>
struct Topic<SimControlReply> {
  static constexpr TopicId kId = TopicId::kControlReply;
  static constexpr const char* kName = "sls/control_reply";
  static constexpr Flow kFlow = Flow::kLatched;
};

/// The names of all topics of the contract.
inline constexpr const char* kTopicNames[kTopics] = {
    Topic<States>::kName,      Topic<Commands>::kName,       Topic<RecordBatch>::kName,
    Topic<Participant>::kName, Topic<Parameters>::kName,     Topic<SimStatus>::kName,
    Topic<SimControl>::kName,  Topic<SimControlReply>::kName};

}  // namespace sls::bus
