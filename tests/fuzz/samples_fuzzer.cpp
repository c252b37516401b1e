/// Any bytes from the network are a sample or are refused, and no sample breaks the code that
/// checks samples. An input consists of samples, each: type, sender, length (2 bytes,
/// little-endian), serialised payload.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <optional>

#include "common/bus/convert.hpp"
#include "common/bus/fastdds/guarded_type.hpp"
#include "recorder/core/stream.hpp"
#include "sim_server/core/answers/command_gate.hpp"
#include "sim_server/core/run_control.hpp"

namespace {

using namespace sls;
namespace rtps = bus::rtps;

constexpr std::uint64_t kRun = 1;

/// The sample that Fast DDS passes to a reader for these bytes; empty if it passes none.
template <class Type, class Message>
std::optional<Message> deserialize(const std::uint8_t* data, std::uint32_t size) {
  rtps::SerializedPayload_t payload(size);
  std::copy(data, data + size, payload.data);
  payload.length = size;
  Message message;
  bus::GuardedType<Type> type;
  if (!bus::deserialize(type, payload, &message)) return std::nullopt;
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
    switch (type % 8) {
      case 0:
        deserialize<StatesPubSubType, States>(data, size);
        break;
      case 1:
        if (const auto commands = deserialize<CommandsPubSubType, Commands>(data, size))
          for (const ControlCommand& command : commands->vehicles()) {
            sim::OfferedAnswer offered;
            offered.run_id = commands->run_id();
            offered.step = commands->step();
            offered.vehicle_id = command.vehicle_id();
            bus::fill(offered.answer, command);
            gate.offer(offered, make_peer(sender));
            if (gate.accepted() || gate.refusal()) gate.expect(++step);
          }
        break;
      case 2:
        if (const auto batch = deserialize<RecordBatchPubSubType, RecordBatch>(data, size))
          stream.add(*batch, now);
        stream.on_time(now += std::chrono::milliseconds(10 * sender));
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
    }
  }

  static Parameters make_parameters() {
    Parameters parameters;
    parameters.period_ns(4'000'000);
    parameters.vehicles().resize(2);
    parameters.vehicles()[1].vehicle_id(1);
    return parameters;
  }
  /// Aborts if a vehicle's rows are not in order.
  void check(const record::StepRows& rows) {
    const auto [last, is_first] = last_steps.try_emplace(rows.vehicle_id, rows.step);
    if (!is_first && rows.step <= last->second) std::abort();
    last->second = rows.step;
  }

  std::uint64_t step = 0;
  sim::CommandGate gate{kRun, 0, {200.0}};
  sim::RunControl control{kRun, {0}, false};
  const Parameters parameters = make_parameters();
  std::map<std::uint32_t, std::uint64_t> last_steps;
  sync::Time now;
  record::Stream stream{parameters, 0, [this](const record::StepRows& rows) { check(rows); },
                        [](std::uint32_t, std::uint64_t, std::uint64_t) {}};
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
  judges.stream.give_up();
  return 0;
}
