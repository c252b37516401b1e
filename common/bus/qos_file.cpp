#include "common/bus/qos_file.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <memory>
#include <sstream>
#include <string_view>
#include <system_error>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/config_error.hpp"
#include "common/config/scenario_reader.hpp"
#include "fastdds_api.hpp"

namespace sls::bus {
namespace {

using config::ConfigError;

constexpr std::uintmax_t kMaxBytes = 1 << 20;
constexpr std::size_t kMaxHosts = 256;  // of one locator
constexpr const char* kIdentityVariable = "SLS_IDENTITY";

constexpr const char* kOurs = "sls_";  // prefix of the names of our profiles

struct Profile {
  const char* element;
  const char* name;
  bool is_required = true;
};
constexpr std::array<Profile, 9> kProfiles = {
    {{"participant", kParticipantProfile},
     {"data_writer", kLoopWriterProfile},
     {"data_reader", kLoopReaderProfile},
     {"data_writer", kRecordWriterProfile},
     {"data_reader", kRecordReaderProfile},
     {"data_writer", kLatchedWriterProfile},
     {"data_reader", kLatchedReaderProfile},
     {"data_writer", kRealtimeCommandWriterProfile, false},
     {"data_reader", kRealtimeCommandReaderProfile, false}}};

struct Found {
  std::string element;
  int line;
};

void collect_profiles(const tinyxml2::XMLElement& element, const std::string& place,
                      std::map<std::string, Found>& found) {
  const std::string kind = element.Name();
  const char* name = element.Attribute("profile_name");
  if (!name && (kind == "data_writer" || kind == "data_reader"))
    throw ConfigError(place + ":" + std::to_string(element.GetLineNum()) + ": <" + kind +
                      ">: expected the attribute profile_name, got none");
  if (name) {
    const auto [earlier, is_new] = found.emplace(name, Found{element.Name(), element.GetLineNum()});
    if (!is_new)
      throw ConfigError(place + ":" + std::to_string(element.GetLineNum()) + ": profile '" + name +
                        "': expected once, got a second one (the first is on line " +
                        std::to_string(earlier->second.line) + ")");
  }
  for (auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement())
    collect_profiles(*child, place, found);
}

std::string join_names(const std::map<std::string, Found>& found) {
  std::string names;
  for (const auto& [name, where] : found) names += (names.empty() ? "" : ", ") + name;
  return names.empty() ? "none" : names;
}

void parse(const std::string& text, const std::string& place, tinyxml2::XMLDocument& document) {
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    throw ConfigError(place + ":" + std::to_string(document.ErrorLineNum()) +
                      ": expected well-formed XML, got " + document.ErrorName());
}

// --- ranges of numbers ---------------------------------------------------------------------------

/// Judges the number of `element`, by which Fast DDS sizes shared memory, sockets or arrays:
/// outside the range programs crash, hang or lose a transport. It refuses other texts itself.
void check_range(const tinyxml2::XMLElement& element, const std::string& where) {
  struct Range {
    std::vector<std::string_view> keys;
    std::int64_t least, most;
    bool is_zero_default = false;
  };
  static const std::vector<Range> ranges = {
      {{"segment_size"}, 131'072, 268'435'456},  // initialising a larger one takes seconds
      {{"port_queue_capacity"}, 1, 65'536},
      {{"healthy_check_timeout_ms"}, 10, 3'600'000},
      {{"maxMessageSize"}, 600, 65'500},
      {{"sendBufferSize", "receiveBufferSize"}, 65'536, 1'073'741'824, true},
      {{"sendSocketBufferSize", "listenSocketBufferSize"}, 65'536, 1'073'741'824, true},
      {{"TTL"}, 0, 255},
      {{"maxInitialPeersRange"}, 0, 110},
      {{"participantID"}, -1, 109},
      {{"domainIDGain", "participantIDGain"}, 1, 1'000},
      {{"port", "physical_port", "output_port", "portBase"}, 0, 65'535},
      {{"offsetd0", "offsetd1", "offsetd2", "offsetd3"}, 0, 65'535},
      {{"depth"}, 1, 100'000},
      {{"max_samples", "max_instances", "max_samples_per_instance"}, -1, 1'000'000},
      {{"allocated_samples", "extra_samples", "readerPayloadSize", "writerPayloadSize"}, 0, 65'500},
      {{"max_properties", "max_user_data", "max_partitions"}, 0, 65'500},
      {{"initial", "increment", "max_unicast_locators", "max_multicast_locators"}, 0, 1'000},
      {{"sec"}, 0, 0x7fffffff},
      {{"nanosec"}, 0, 0xffffffff}};
  std::string text = element.GetText() ? element.GetText() : "";
  text.erase(0, text.find_first_not_of(" \t\r\n"));
  text.erase(text.find_last_not_of(" \t\r\n") + 1);
  if (text.find_first_of("0123456789") > 1) return;  // behind a sign at most
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_number = error == std::errc() && end == text.data() + text.size();
  for (const Range& range : ranges) {
    const bool fits = is_number && ((number >= range.least && number <= range.most) ||
                                    (number == 0 && range.is_zero_default));
    if (std::count(range.keys.begin(), range.keys.end(), element.Name()) && !fits)
      throw ConfigError(where + ": <" + element.Name() + ">: expected " +
                        std::to_string(range.least) + " to " + std::to_string(range.most) +
                        ", got '" + text + "'");
  }
}

// --- parts that depend on the process ------------------------------------------------------------

/// Value of the variable in `${…}`, which is NAME or NAME:-default.
std::string find_value(const std::string& expression, const std::string& identity,
                       const std::string& place) {
  const auto divider = expression.find(":-");
  const std::string name = expression.substr(0, divider);
  if (const char* value = std::getenv(name.c_str()); value && *value) return value;
  if (name == kIdentityVariable) return identity;
  if (divider != std::string::npos) return expression.substr(divider + 2);
  throw ConfigError(place + ": ${" + name +
                    "}: expected an environment variable of this name, got none");
}

/// `text` with every `${…}` replaced. Inserted text is not expanded again.
std::string expand(const std::string& text, const std::string& identity, const std::string& place) {
  std::string expanded;
  std::size_t from = 0;
  for (auto begin = text.find("${"); begin != std::string::npos; begin = text.find("${", from)) {
    const auto end = text.find('}', begin);
    if (end == std::string::npos)
      throw ConfigError(place + ": '" + text.substr(begin) +
                        "': expected '}' behind '${', got none");
    expanded += text.substr(from, begin - from);
    expanded += find_value(text.substr(begin + 2, end - begin - 2), identity, place);
    from = end + 1;
  }
  return expanded + text.substr(from);
}

std::string resolve(const std::string& host, const std::string& place) {
  in_addr address;
  if (::inet_pton(AF_INET, host.c_str(), &address) == 1) return host;
  addrinfo hints = {};
  hints.ai_family = AF_INET;
  addrinfo* found = nullptr;
  const int error = ::getaddrinfo(host.c_str(), nullptr, &hints, &found);
  if (error != 0)
    throw ConfigError(place + ": host '" + host +
                      "': expected a name or an IPv4 address, got: " + ::gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
  std::array<char, INET_ADDRSTRLEN> text;
  return ::inet_ntop(AF_INET, &reinterpret_cast<sockaddr_in*>(found->ai_addr)->sin_addr,
                     text.data(), text.size());
}

std::vector<std::string> split_hosts(const std::string& list) {
  std::vector<std::string> hosts;
  std::istringstream stream(list);
  for (std::string host; std::getline(stream, host, ',');) {
    const auto begin = host.find_first_not_of(" \t\n"), end = host.find_last_not_of(" \t\n");
    if (begin != std::string::npos) hosts.push_back(host.substr(begin, end - begin + 1));
  }
  return hosts;
}

/// Replaces `locator` with one locator for each host of its address; returns the last one.
tinyxml2::XMLElement* expand_locator(tinyxml2::XMLElement& locator, const std::string& place) {
  auto* udp = locator.FirstChildElement("udpv4");
  auto* address = udp ? udp->FirstChildElement("address") : nullptr;
  if (!address || !address->GetText()) return &locator;
  const std::string where = place + ":" + std::to_string(address->GetLineNum());
  const std::vector<std::string> hosts = split_hosts(address->GetText());
  if (hosts.size() > kMaxHosts)
    throw ConfigError(where + ": expected at most " + std::to_string(kMaxHosts) + " hosts, got " +
                      std::to_string(hosts.size()));
  if (!hosts.empty()) address->SetText("");  // a clone must not copy them all
  auto* last = &locator;
  for (const std::string& host : hosts) {
    auto* one = locator.DeepClone(locator.GetDocument())->ToElement();
    one->FirstChildElement("udpv4")->FirstChildElement("address")->SetText(
        resolve(host, where).c_str());
    last = locator.Parent()->InsertAfterChild(last, one)->ToElement();
  }
  if (last != &locator) locator.GetDocument()->DeleteNode(&locator);
  return last;
}

void complete(tinyxml2::XMLElement& element, const std::string& identity, const std::string& place,
              bool is_in_locator = false) {
  const std::string where = place + ":" + std::to_string(element.GetLineNum());
  const bool is_locator = std::string(element.Name()) == "locator";
  // A nested locator would be copied for each host of the outer one, at every level.
  if (is_locator && is_in_locator)
    throw ConfigError(where + ": <locator>: expected none within another <locator>, got one");
  if (element.FirstChild() && element.FirstChild()->ToText())
    element.SetText(expand(element.GetText(), identity, where).c_str());
  check_range(element, where);
  for (auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement()) {
    complete(*child, identity, place, is_in_locator || is_locator);
    if (std::string(child->Name()) == "locator") child = expand_locator(*child, place);
  }
}

// --- versions of the middleware ------------------------------------------------------------------

/// Elements that Fast DDS 3 renamed: the names in version 2 and in version 3.
constexpr std::array<std::array<const char*, 2>, 7> kRenamed = {
    {{"heartbeatPeriod", "heartbeat_period"},
     {"heartbeatResponseDelay", "heartbeat_response_delay"},
     {"initialAcknackDelay", "initial_acknack_delay"},
     {"initialHeartbeatDelay", "initial_heartbeat_delay"},
     {"nackResponseDelay", "nack_response_delay"},
     {"nackSupressionDuration", "nack_supression_duration"},
     {"expectsInlineQos", "expects_inline_qos"}}};

/// Gives the elements the names of the version in use: a QoS file may have those of either.
void rename(tinyxml2::XMLElement& element) {
  // Version 3 lists the addresses of discovery servers without the servers.
  if (kFastDdsMajor == 3 && std::string(element.Name()) == "discoveryServersList")
    while (auto* server = element.FirstChildElement("RemoteServer")) {
      if (auto* addresses = server->FirstChildElement("metatrafficUnicastLocatorList"))
        while (auto* address = addresses->FirstChildElement()) element.InsertEndChild(address);
      element.DeleteChild(server);
    }
  for (const auto& names : kRenamed)
    if (element.Name() == std::string(names[3 - kFastDdsMajor]))
      element.SetName(names[kFastDdsMajor - 2]);
  for (auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement())
    rename(*child);
}

// --- limits of the middleware --------------------------------------------------------------------

/// The first element of this name and text, in `element` or below; an empty `text` fits any text.
const tinyxml2::XMLElement* find_element(const tinyxml2::XMLElement& element,
                                         const std::string& name, const std::string& text = {}) {
  const char* own = element.GetText();
  if (element.Name() == name && own && (text.empty() || own == text)) return &element;
  for (auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement())
    if (const auto* found = find_element(*child, name, text)) return found;
  return nullptr;
}

/// The line of the only element of this name in `element` and below; 0 if there is none, −1 if
/// there are several.
int find_line(const tinyxml2::XMLElement& element, const std::string& name) {
  int line = element.Name() == name ? element.GetLineNum() : 0;
  for (auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement())
    if (const int found = find_line(*child, name)) line = line == 0 ? found : -1;
  return line;
}

/// Fast DDS 2.9 does not authenticate participants that a discovery server announces: all programs
/// would wait for ever.
void check_discovery(const tinyxml2::XMLElement& root, const std::string& place) {
  const auto* protocol = find_element(root, "discoveryProtocol");
  if (!protocol || std::string(protocol->GetText()) == "SIMPLE") return;
  if (find_element(root, "name", "dds.sec.auth.plugin"))
    throw ConfigError(place + ":" + std::to_string(protocol->GetLineNum()) +
                      ": <discoveryProtocol>: expected SIMPLE beside DDS Security, which Fast DDS "
                      "2.9 cannot do through a discovery server (SLS_PEERS works without "
                      "multicast), got '" +
                      protocol->GetText() + "'");
}

// --- profiles ------------------------------------------------------------------------------------

/// Refuses misspelt names of our profiles, which would be ignored silently.
void check_names(const std::map<std::string, Found>& found, const std::string& place) {
  for (const auto& [name, where] : found) {
    const std::string start =
        place + ":" + std::to_string(where.line) + ": profile '" + name + "': ";
    const auto* known =
        std::find_if(kProfiles.begin(), kProfiles.end(),
                     [&name = name](const Profile& profile) { return name == profile.name; });
    if (known == kProfiles.end()) {
      if (name.rfind(kOurs, 0) == 0)
        throw ConfigError(start + "expected one that config/qos/README.md lists, got this name");
    } else if (where.element != known->element) {
      throw ConfigError(start + "expected <" + known->element + ">, got <" + where.element + ">");
    }
  }
}

/// Adds the profiles of endpoints.xml that `found` lacks to the profiles of `root`.
void add_missing_endpoints(tinyxml2::XMLElement& root, std::map<std::string, Found>& found) {
  const auto file = default_qos_file().parent_path() / "endpoints.xml";
  tinyxml2::XMLDocument shared;
  parse(config::read_config_file(file, "a QoS file", kMaxBytes), file.string(), shared);
  auto* profiles = root.FirstChildElement("profiles");
  if (!profiles) return;  // the participant's profile is missing, too, and is reported later
  const auto* shared_profiles = shared.RootElement()->FirstChildElement("profiles");
  for (auto* profile = shared_profiles->FirstChildElement(); profile;
       profile = profile->NextSiblingElement()) {
    const Found here{profile->Name(), profile->GetLineNum()};
    if (found.emplace(profile->Attribute("profile_name"), here).second)
      profiles->InsertEndChild(profile->DeepClone(root.GetDocument()));
  }
}

}  // namespace

std::string find_identity(const std::string& role) {
  const char* identity = std::getenv(kIdentityVariable);
  return identity && *identity ? identity : role;
}

std::string read_qos_file(const std::filesystem::path& file, const std::string& identity) {
  const std::string place = file.string();
  tinyxml2::XMLDocument document;
  parse(config::read_config_file(file, "a QoS file", kMaxBytes), place, document);

  std::map<std::string, Found> found;
  if (auto* root = document.RootElement()) {
    collect_profiles(*root, place, found);
    complete(*root, identity, place);
    check_discovery(*root, place);
  }
  check_names(found, place);
  const std::map<std::string, Found> own = found;
  if (auto* root = document.RootElement()) add_missing_endpoints(*root, found);
  for (const Profile& profile : kProfiles)
    if (profile.is_required && found.count(profile.name) == 0)
      throw ConfigError(place + ": profile '" + profile.name + "': expected a <" + profile.element +
                        "> of this name, got only: " + join_names(own));
  if (auto* root = document.RootElement()) rename(*root);
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

std::string describe_refusal(const std::filesystem::path& file, const std::string& cause) {
  const std::string version = std::string("Fast DDS ") + kMiddlewareVersion;
  constexpr std::string_view kBefore = ". Name: ";  // "Invalid element found into 'x'. Name: y"
  const auto at = cause.rfind(kBefore);
  if (at == cause.npos)
    return file.string() + ": expected profiles that " + version + " takes, got: " + cause;
  const std::string key = cause.substr(at + kBefore.size());
  tinyxml2::XMLDocument document;
  parse(config::read_config_file(file, "a QoS file", kMaxBytes), file.string(), document);
  const int line = find_line(*document.RootElement(), key);
  return file.string() + (line > 0 ? ":" + std::to_string(line) : "") + ": <" + key +
         ">: expected a key of " + version + ", got a misspelt one or one of another version (" +
         cause.substr(0, at) + ")";
}

std::filesystem::path default_qos_file() {
  if (const char* folder = std::getenv("SLS_CONFIG"); folder && *folder)
    return std::filesystem::path(folder) / "qos/default.xml";
  // build/bin/PROGRAM of a checkout, PREFIX/bin/PROGRAM of an installation, any other build folder.
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto prefix = program.parent_path().parent_path();
  for (const auto& folder : {prefix.parent_path() / "config", prefix / "share/sls/config"})
    if (std::filesystem::exists(folder / "qos/default.xml", error))
      return folder / "qos/default.xml";
  return SLS_SOURCE_CONFIG_DIR "/qos/default.xml";
}

}  // namespace sls::bus
