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

/// The topics by number.
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

/// The names of all topics of the contract, by their numbers.
inline constexpr const char* kTopicNames[kTopics] = {
    "sls/state",      "sls/command", "sls/record",  "sls/participant",
    "sls/parameters", "sls/status",  "sls/control", "sls/control_reply"};

template <TopicId kTopic, Flow kOf>
struct TopicOf {
  static constexpr TopicId kId = kTopic;
  static constexpr const char* kName = kTopicNames[static_cast<std::size_t>(kTopic)];
  static constexpr Flow kFlow = kOf;
};

/// The topic that carries `Message`.
template <class Message>
struct Topic;
template <>
struct Topic<States> : TopicOf<TopicId::kState, Flow::kLoop> {};
template <>
struct Topic<Commands> : TopicOf<TopicId::kCommand, Flow::kLoop> {};
template <>
struct Topic<RecordBatch> : TopicOf<TopicId::kRecord, Flow::kRecord> {};
template <>
struct Topic<Participant> : TopicOf<TopicId::kParticipant, Flow::kLatched> {};
template <>
struct Topic<Parameters> : TopicOf<TopicId::kParameters, Flow::kLatched> {};
template <>
struct Topic<SimStatus> : TopicOf<TopicId::kStatus, Flow::kLatched> {};
template <>
struct Topic<SimControl> : TopicOf<TopicId::kControl, Flow::kLatched> {};
template <>
struct Topic<SimControlReply> : TopicOf<TopicId::kControlReply, Flow::kLatched> {};

}  // namespace sls::bus
