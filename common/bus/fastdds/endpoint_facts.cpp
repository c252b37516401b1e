#include "common/bus/fastdds/endpoint_facts.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <iterator>

#include "common/bus/topics.hpp"
#include "common/config/yaml_node.hpp"
#include "common/text/edit_distance.hpp"

namespace sls::bus {
namespace {

constexpr int kXcdr1 = 0;

std::string to_words(const std::optional<std::chrono::nanoseconds>& period) {
  return period ? fmt::format("{:g} s", std::chrono::duration<double>(*period).count()) : "none";
}

std::string to_words(EndpointFacts::Durability durability) {
  switch (durability) {
    case EndpointFacts::Durability::kVolatile:
      return "volatile";
    case EndpointFacts::Durability::kTransientLocal:
      return "transient local";
    case EndpointFacts::Durability::kTransient:
      return "transient";
    case EndpointFacts::Durability::kPersistent:
      return "persistent";
  }
  return "unknown";
}

std::string to_words(EndpointFacts::Liveliness liveliness) {
  switch (liveliness) {
    case EndpointFacts::Liveliness::kAutomatic:
      return "automatic";
    case EndpointFacts::Liveliness::kManualByParticipant:
      return "manual by participant";
    case EndpointFacts::Liveliness::kManualByTopic:
      return "manual by topic";
  }
  return "unknown";
}

std::string to_words(const std::vector<int>& representations) {
  std::string words;
  for (const int id : representations)
    words += (words.empty() ? "" : " or ") + (id == kXcdr1 ? std::string("XCDR1")
                                              : id == 1    ? "XML"
                                              : id == 2    ? "XCDR2"
                                                           : fmt::format("number {}", id));
  return words;
}

std::string to_words(const std::vector<std::string>& partitions) {
  std::string words;
  for (const std::string& name : partitions)
    words += (words.empty() ? "'" : ", '") + config::to_printable(name) + "'";
  return words.empty() ? "none" : words;
}

/// An empty list means the default, XCDR1.
std::vector<int> to_list(std::vector<int> representations) {
  if (representations.empty()) representations = {kXcdr1};
  return representations;
}

template <class Value>
bool share_one(const std::vector<Value>& a, const std::vector<Value>& b) {
  return std::any_of(a.begin(), a.end(), [&](const Value& value) {
    return std::find(b.begin(), b.end(), value) != b.end();
  });
}

/// True if the writer offers a longer period than the reader requests. No period: infinite.
bool is_longer(const std::optional<std::chrono::nanoseconds>& offered,
               const std::optional<std::chrono::nanoseconds>& asked) {
  return asked && (!offered || *offered > *asked);
}

/// Lower case, each run of separators as one '/', none at the ends, and no "rt/" of ROS 2 before.
std::string simplify(const std::string& name) {
  std::string simple;
  for (const char letter : name) {
    const bool is_separator = std::strchr("/_.:- ", letter) != nullptr;
    if (!is_separator)
      simple += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    else if (!simple.empty() && simple.back() != '/')
      simple += '/';
  }
  if (!simple.empty() && simple.back() == '/') simple.pop_back();
  return simple.compare(0, 3, "rt/") == 0 ? simple.substr(3) : simple;
}

bool is_of_sls(const std::string& simple_name) { return simple_name.compare(0, 3, "sls") == 0; }

}  // namespace

std::vector<Mismatch> find_mismatches(const EndpointFacts& writer, const EndpointFacts& reader) {
  std::vector<Mismatch> found;
  const auto add = [&](const char* policy, const auto& offered, const auto& asked,
                       const char* hint = "") {
    found.push_back({policy, fmt::format("{}: offered {}, asked {}{}", policy, to_words(offered),
                                         to_words(asked), hint)});
  };
  const auto add_words = [&](const char* policy, const char* offered, const char* asked) {
    found.push_back({policy, fmt::format("{}: offered {}, asked {}", policy, offered, asked)});
  };
  const auto offered = to_list(writer.representations), asked = to_list(reader.representations);
  if (!share_one(offered, asked))
    add("DATA_REPRESENTATION", offered, asked, " (compile the types as @final)");
  if (!writer.is_reliable && reader.is_reliable)
    add_words("RELIABILITY", "best effort", "reliable");
  if (writer.durability < reader.durability)
    add("DURABILITY", writer.durability, reader.durability);
  if (is_longer(writer.deadline, reader.deadline))
    add("DEADLINE", writer.deadline, reader.deadline);
  if (writer.liveliness < reader.liveliness)
    add("LIVELINESS", writer.liveliness, reader.liveliness);
  if (is_longer(writer.lease, reader.lease)) add("LIVELINESS lease", writer.lease, reader.lease);
  if (writer.is_exclusive != reader.is_exclusive)
    add_words("OWNERSHIP", writer.is_exclusive ? "exclusive" : "shared",
              reader.is_exclusive ? "exclusive" : "shared");
  const bool has_partition = !writer.partitions.empty() || !reader.partitions.empty();
  if (has_partition && !share_one(writer.partitions, reader.partitions))
    add("PARTITION", writer.partitions, reader.partitions);
  return found;
}

std::vector<Mismatch> compare(const EndpointFacts& own, const EndpointFacts& other) {
  if (own.topic != other.topic || own.is_writer == other.is_writer) return {};
  if (own.type != other.type)  // then the rest means nothing
    return {{"type", fmt::format("type: expected {}, got {}", own.type,
                                 config::to_printable(other.type, 80))}};
  auto found = own.is_writer ? find_mismatches(own, other) : find_mismatches(other, own);
  if (own.is_keyed != other.is_keyed)
    found.insert(found.begin(), {"key", fmt::format("key: expected {}, got {}",
                                                    own.is_keyed ? "a keyed type" : "none",
                                                    other.is_keyed ? "a keyed type" : "none")});
  return found;
}

std::optional<std::string> find_meant_topic(const EndpointFacts& endpoint) {
  constexpr std::size_t kLongest = 64, kMostEdits = 1;
  const auto& known = kTopicNames;
  const std::string& topic = endpoint.topic;
  if (topic.size() > kLongest ||
      std::find(std::begin(known), std::end(known), topic) != std::end(known))
    return std::nullopt;
  std::string simple = simplify(topic);
  if (!is_of_sls(simple)) {
    if (!is_of_sls(simplify(endpoint.type))) return std::nullopt;
    simple = "sls/" + simple;
  }
  std::optional<std::string> meant;
  std::size_t least = kMostEdits + 1;
  for (const char* name : known) {
    const std::size_t edits = text::calc_edit_distance(simple, simplify(name));
    if (edits >= least) continue;
    least = edits;
    meant = name;
  }
  return meant;
}

}  // namespace sls::bus
