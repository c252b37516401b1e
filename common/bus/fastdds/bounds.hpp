/// Checks the bounds of the sequences in idl/sls.idl, because the generated code does not. A
/// sequence beyond its bound cannot be sent again in another sample.
#pragma once

#include <sls.h>

#include <string>
#include <vector>

namespace sls::bus {

/// "64 vehicles, got 65"; empty if there are at most `most` elements.
template <class Element>
std::string find_excess(const char* name, const std::vector<Element>& sequence, std::size_t most) {
  if (sequence.size() <= most) return "";
  return std::to_string(most) + " " + name + ", got " + std::to_string(sequence.size());
}

/// The same for the first sequence of a message that is too long. This default is for messages
/// without bounded sequences.
template <class Message>
std::string find_excess(const Message&) {
  return "";
}

inline std::string find_excess(const ControllerState& state) {
  return find_excess("controller.numbers", state.numbers(), MOST_NUMBERS);
}
inline std::string find_excess(const PlantState& state) {
  return find_excess("signals", state.signals(), MOST_NUMBERS);
}
inline std::string find_excess(const VehicleState& state) {
  const std::string excess = find_excess(state.measured());
  return excess.empty() ? find_excess(state.controller()) : excess;
}
inline std::string find_excess(const ControlCommand& command) {
  return find_excess(command.controller());
}
inline std::string find_excess(const RecordEntry& entry) {
  std::string excess = find_excess("measured states", entry.measured(), 1);
  if (excess.empty()) excess = find_excess(entry.truth());
  if (excess.empty() && !entry.measured().empty()) excess = find_excess(entry.measured().front());
  return excess.empty() ? find_excess(entry.answer()) : excess;
}

/// The same for a sequence and then for its elements.
template <class Element>
std::string find_excess_of_each(const char* name, const std::vector<Element>& sequence,
                                std::size_t most) {
  std::string excess = find_excess(name, sequence, most);
  for (const Element& element : sequence)
    if (excess.empty()) excess = find_excess(element);
  return excess;
}

inline std::string find_excess(const States& sample) {
  return find_excess_of_each("vehicles", sample.vehicles(), SAMPLE_VEHICLES);
}
inline std::string find_excess(const Commands& sample) {
  return find_excess_of_each("vehicles", sample.vehicles(), SAMPLE_VEHICLES);
}
inline std::string find_excess(const RecordBatch& batch) {
  return find_excess_of_each("entries", batch.entries(), BATCH_ENTRIES);
}
inline std::string find_excess(const Participant& message) {
  return find_excess("vehicle_ids", message.vehicle_ids(), 256);
}
inline std::string find_excess(const Parameters& message) {
  const std::string excess = find_excess("vehicles", message.vehicles(), 256);
  return excess.empty() ? find_excess("signals", message.signals(), MOST_NUMBERS) : excess;
}

}  // namespace sls::bus
