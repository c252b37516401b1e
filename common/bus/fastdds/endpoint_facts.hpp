/// The properties in which two endpoints of one topic must agree. No Fast DDS here: neighbours.hpp
/// fills it in.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace sls::bus {

/// The announced properties of a writer or reader.
struct EndpointFacts {
  std::string topic;
  std::string type;
  bool is_writer = false;
  bool is_keyed = false;
  bool is_reliable = false;
  enum class Durability { kVolatile, kTransientLocal, kTransient, kPersistent };
  Durability durability = Durability::kVolatile;
  std::optional<std::chrono::nanoseconds> deadline;  ///< nothing: infinite
  enum class Liveliness { kAutomatic, kManualByParticipant, kManualByTopic };
  Liveliness liveliness = Liveliness::kAutomatic;
  std::optional<std::chrono::nanoseconds> lease;  ///< of the liveliness; nothing: infinite
  bool is_exclusive = false;                      ///< ownership
  std::vector<int> representations;               ///< 0 XCDR1, 1 XML, 2 XCDR2; none: XCDR1
  std::vector<std::string> partitions;
};

/// One thing in which they differ, in words: "DEADLINE: offered none, asked 0.1 s".
struct Mismatch {
  std::string policy;
  std::string text;
};

/// Why a writer of the topic does not reach the reader, or its samples cannot be read there: type,
/// key, data representation, or the policies of the DDS standard. Empty if all is well.
std::vector<Mismatch> find_mismatches(const EndpointFacts& writer, const EndpointFacts& reader);

/// The same of an endpoint of our own and another one, of which one is a writer; of two writers or
/// readers and of other topics nothing. A wrong type is named by what was expected of the other.
std::vector<Mismatch> compare(const EndpointFacts& own, const EndpointFacts& other);

/// True if only a program of the first contract has such an endpoint.
bool is_of_contract_1(const EndpointFacts& endpoint);

}  // namespace sls::bus
