/// The topics of idl/sls.idl: name and QoS profiles of each type. The table in idl/README.md.
#pragma once

#include <sls.h>  // generated from idl/sls.idl

namespace sls::bus {

/// What a topic is for decides its QoS profiles: config/qos/README.md.
enum class Flow {
  kStream,   ///< one sample per control period: state, command, reference of one vehicle
  kFleet,    ///< the same of several vehicles in one sample: fewer samples, larger ones
  kLatched,  ///< what a late joiner must know: participant, parameters, status; and control, whose
             ///< requests carry a run_id, so that none acts on a later run
};

/// Profile names in a QoS file.
inline constexpr const char* kParticipantProfile = "sls_participant";
inline constexpr const char* kStreamWriterProfile = "sls_stream_writer";
inline constexpr const char* kLoopReaderProfile = "sls_loop_reader";
inline constexpr const char* kRecorderReaderProfile = "sls_recorder_reader";
inline constexpr const char* kFleetWriterProfile = "sls_fleet_writer";
inline constexpr const char* kFleetLoopReaderProfile = "sls_fleet_loop_reader";
inline constexpr const char* kFleetRecorderReaderProfile = "sls_fleet_recorder_reader";
inline constexpr const char* kLatchedWriterProfile = "sls_latched_writer";
inline constexpr const char* kLatchedReaderProfile = "sls_latched_reader";
/// sls/command, and sls/fleet_command, in real time, with DEADLINE and LIFESPAN; a file without
/// them flies without these.
inline constexpr const char* kRealtimeCommandWriterProfile = "sls_realtime_command_writer";
inline constexpr const char* kRealtimeCommandReaderProfile = "sls_realtime_command_reader";
inline constexpr const char* kRealtimeFleetCommandWriterProfile =
    "sls_realtime_fleet_command_writer";
inline constexpr const char* kRealtimeFleetCommandReaderProfile =
    "sls_realtime_fleet_command_reader";

/// Writer profile of a flow.
constexpr const char* find_writer_profile(Flow flow) {
  return flow == Flow::kStream  ? kStreamWriterProfile
         : flow == Flow::kFleet ? kFleetWriterProfile
                                : kLatchedWriterProfile;
}

/// `kName` and `kFlow` of the topic that carries `Message`.
template <class Message>
struct Topic;

template <>
struct Topic<VehicleState> {
  static constexpr const char* kName = "sls/state";
  static constexpr Flow kFlow = Flow::kStream;
};
template <>
struct Topic<ControlCommand> {
  static constexpr const char* kName = "sls/command";
  static constexpr Flow kFlow = Flow::kStream;
};
template <>
struct Topic<Reference> {
  static constexpr const char* kName = "sls/reference";
  static constexpr Flow kFlow = Flow::kStream;
};
template <>
struct Topic<FleetState> {
  static constexpr const char* kName = "sls/fleet_state";
  static constexpr Flow kFlow = Flow::kFleet;
};
template <>
struct Topic<FleetCommand> {
  static constexpr const char* kName = "sls/fleet_command";
  static constexpr Flow kFlow = Flow::kFleet;
};
template <>
struct Topic<FleetReference> {
  static constexpr const char* kName = "sls/fleet_reference";
  static constexpr Flow kFlow = Flow::kFleet;
};
template <>
struct Topic<Participant> {
  static constexpr const char* kName = "sls/participant";
  static constexpr Flow kFlow = Flow::kLatched;
};
template <>
struct Topic<Parameters> {
  static constexpr const char* kName = "sls/parameters";
  static constexpr Flow kFlow = Flow::kLatched;
};
template <>
struct Topic<SimStatus> {
  static constexpr const char* kName = "sls/status";
  static constexpr Flow kFlow = Flow::kLatched;
};
template <>
struct Topic<SimControl> {
  static constexpr const char* kName = "sls/control";
  static constexpr Flow kFlow = Flow::kLatched;
};
template <>
struct Topic<SimControlReply> {
  static constexpr const char* kName = "sls/control_reply";
  static constexpr Flow kFlow = Flow::kLatched;
};

}  // namespace sls::bus
