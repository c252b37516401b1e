/// Any bytes from the network are a sample or none, and no samples disturb what judges them. An
/// input is samples, each: type, sender, length (2 bytes, little-endian), serialised payload.
#include <algorithm>
#include <cstdint>
#include <optional>

#include "common/bus/fastdds/guarded_type.hpp"
#include "recorder/step_join.hpp"
#include "sim_server/command_gate.hpp"
#include "sim_server/run_control.hpp"

namespace {

using namespace sls;
namespace rtps = eprosima::fastrtps::rtps;

constexpr std::uint64_t kRun = 1;

/// The sample of these bytes as the middleware hands it to a reader; nothing where it does not.
template <class Type, class Message>
std::optional<Message> deserialize(const std::uint8_t* data, std::uint32_t size) {
  rtps::SerializedPayload_t payload(size);
  std::copy(data, data + size, payload.data);
  payload.length = size;
  Message message;
  bus::GuardedType<Type> type;
  if (!type.deserialize(&payload, &message)) return std::nullopt;
  return message;
}

struct Judges {
  Judges() {
    gate.set_clients({{make_peer(0), "client", 0}, {make_peer(1), "standby", 1}});
    gate.expect(0);
  }
  static bus::PeerId make_peer(std::uint8_t number) {
    bus::PeerId peer;
    peer.bytes[0] = number;
    return peer;
  }

  void judge(std::uint8_t type, std::uint8_t sender, const std::uint8_t* data, std::uint32_t size) {
    switch (type % 11) {
      case 0:
        if (const auto state = deserialize<VehicleStatePubSubType, VehicleState>(data, size))
          join.add(*state);
        break;
      case 1:
        if (const auto command =
                deserialize<ControlCommandPubSubType, ControlCommand>(data, size)) {
          gate.offer(*command, make_peer(sender));
          if (gate.accepted() || gate.refusal()) gate.expect(++step);
          join.add(*command, make_peer(sender));
        }
        break;
      case 2:
        if (const auto reference = deserialize<ReferencePubSubType, Reference>(data, size))
          join.add(*reference, make_peer(sender));
        break;
      case 3:
        if (const auto request = deserialize<SimControlPubSubType, SimControl>(data, size)) {
          control.request(*request, step);
          control.stepped(step);
        }
        break;
      case 4:
        deserialize<ParticipantPubSubType, Participant>(data, size);
        break;
      case 5:
        deserialize<ParametersPubSubType, Parameters>(data, size);
        break;
      case 6:
        deserialize<SimStatusPubSubType, SimStatus>(data, size);
        break;
      case 7:
        deserialize<SimControlReplyPubSubType, SimControlReply>(data, size);
        break;
      case 8:
        if (const auto fleet = deserialize<FleetStatePubSubType, FleetState>(data, size))
          for (const VehicleState& state : fleet->vehicles()) join.add(state);
        break;
      case 9:
        if (const auto fleet = deserialize<FleetCommandPubSubType, FleetCommand>(data, size))
          for (const ControlCommand& command : fleet->vehicles())
            gate.offer(command, make_peer(sender));
        break;
      case 10:
        if (const auto fleet = deserialize<FleetReferencePubSubType, FleetReference>(data, size))
          for (const Reference& reference : fleet->vehicles())
            join.add(reference, make_peer(sender));
        break;
    }
  }

  std::uint64_t step = 0;
  sim::CommandGate gate{kRun, 0, 200.0};
  sim::RunControl control{kRun, {0}, false};
  record::StepJoin join{[](const record::StepRecord&) {}};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kHeader = 4;
  Judges judges;
  while (size >= kHeader) {
    const std::size_t length = std::min<std::size_t>(data[2] | data[3] << 8, size - kHeader);
    judges.judge(data[0], data[1], data + kHeader, static_cast<std::uint32_t>(length));
    data += kHeader + length;
    size -= kHeader + length;
  }
  judges.join.give_up();
  return 0;
}
