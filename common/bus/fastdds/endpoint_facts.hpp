/// The properties in which two endpoints of one topic must agree. No Fast DDS here: facts_of.hpp
/// fills them in.
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

/// One difference; `text` is like "DEADLINE: offered none, asked 0.1 s".
struct Mismatch {
  std::string policy;
  std::string text;
};

/// The reasons why the writer does not match the reader, or why its samples cannot be read there:
/// data representation and the policies of the DDS standard. Empty if there are none.
std::vector<Mismatch> find_mismatches(const EndpointFacts& writer, const EndpointFacts& reader);

/// The same for an endpoint of our own and another one; also compares type and key, of which the
/// text names what was expected of the other endpoint. Empty for two writers, for two readers and
/// for different topics.
std::vector<Mismatch> compare(const EndpointFacts& own, const EndpointFacts& other);

/// The topic of ours that an endpoint's topic most likely means: "sls/command" for "sls/commands",
/// "/sls/command", "sls_command" and, as ROS 2 names it, "rt/sls/command"; also for "command" if
/// its type is ours. Nothing for a topic of ours, and for a topic of others.
std::optional<std::string> find_meant_topic(const EndpointFacts& endpoint);

}  // namespace sls::bus
