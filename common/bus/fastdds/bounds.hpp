/// Checks the bounds of sequences and names in idl/sls.idl, because the generated code does not. A
/// sequence beyond its bound cannot be sent again in another sample, and a name beyond its bound is
/// cut: the answers of its client then seem to be those of another one.
#pragma once

#include <sls.h>

#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "fastdds_api.hpp"

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

/// True if `cdr` contains a string that is longer than `kMost` bytes and begins with `text`, the
/// part of it that was kept. `is_swapped`: the lengths in `cdr` have the other byte order.
template <std::size_t kMost>
bool is_cut(const FixedString<kMost>& text, std::string_view cdr, bool is_swapped) {
  if (text.size() < kMost) return false;
  for (auto at = cdr.find(text.c_str()); at != cdr.npos; at = cdr.find(text.c_str(), at + 1)) {
    if (at < sizeof(std::uint32_t)) continue;
    std::uint32_t length = 0;  // with the terminating zero
    std::memcpy(&length, cdr.data() + at - sizeof length, sizeof length);
    if (is_swapped) length = __builtin_bswap32(length);
    if (length > kMost + 1 && length <= cdr.size() - at) return true;
  }
  return false;
}

/// "32 bytes in client_name, got more" if the sample `cdr` has a longer name than `message`, which
/// was read from it, can hold; else empty. This default is for messages whose names come from
/// servers alone.
template <class Message>
std::string find_cut_name(const Message&, std::string_view, bool) {
  return "";
}
inline std::string find_cut_name(const Commands& sample, std::string_view cdr, bool is_swapped) {
  if (is_cut(sample.client_name(), cdr, is_swapped)) return "32 bytes in client_name, got more";
  for (const ControlCommand& command : sample.vehicles())
    if (is_cut(command.reference().stage_name(), cdr, is_swapped))
      return "32 bytes in reference.stage_name, got more";
  return "";
}
inline std::string find_cut_name(const Participant& message, std::string_view cdr,
                                 bool is_swapped) {
  if (is_cut(message.name(), cdr, is_swapped)) return "32 bytes in name, got more";
  return is_cut(message.host(), cdr, is_swapped) ? "64 bytes in host, got more" : "";
}

}  // namespace sls::bus
