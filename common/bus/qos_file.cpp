#include "common/bus/qos_file.hpp"

#include <tinyxml2.h>

#include <array>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <system_error>

#include "common/bus/topics.hpp"
#include "common/config/config_error.hpp"

namespace sls::bus {
namespace {

using config::ConfigError;

constexpr std::uintmax_t kMaxBytes = 1 << 20;

struct Required {
  const char* element;
  const char* name;
};
constexpr std::array<Required, 6> kRequired = {{{"participant", kParticipantProfile},
                                                {"data_writer", kStreamWriterProfile},
                                                {"data_reader", kLoopReaderProfile},
                                                {"data_reader", kRecorderReaderProfile},
                                                {"data_writer", kLatchedWriterProfile},
                                                {"data_reader", kLatchedReaderProfile}}};

struct Found {
  std::string element;
  int line;
};

void collect_profiles(const tinyxml2::XMLElement& element, const std::string& place,
                      std::map<std::string, Found>& found) {
  if (const char* name = element.Attribute("profile_name")) {
    const auto [earlier, is_new] = found.emplace(name, Found{element.Name(), element.GetLineNum()});
    if (!is_new)
      throw ConfigError(place + ":" + std::to_string(element.GetLineNum()) + ": profile '" + name +
                        "': expected once, got a second one (the first is on line " +
                        std::to_string(earlier->second.line) + ")");
  }
  for (auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement())
    collect_profiles(*child, place, found);
}

std::string read_file(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status))
    throw ConfigError(file.string() + ": expected a QoS file, got no such file");
  if (std::filesystem::is_directory(status))
    throw ConfigError(file.string() + ": expected a QoS file, got a directory");
  if (!std::filesystem::is_regular_file(status))  // reading it might never end
    throw ConfigError(file.string() + ": expected a QoS file, got a pipe, socket or device");
  const auto size = std::filesystem::file_size(file, error);
  if (!error && size > kMaxBytes)
    throw ConfigError(file.string() + ": expected at most " + std::to_string(kMaxBytes) +
                      " bytes, got " + std::to_string(size));
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  if (!stream || !(text << stream.rdbuf()))
    throw ConfigError(
        file.string() + ": expected a readable QoS file, got " +
        (size == 0 ? std::string("an empty file") : std::generic_category().message(errno)));
  return text.str();
}

std::string join_names(const std::map<std::string, Found>& found) {
  std::string names;
  for (const auto& [name, where] : found) names += (names.empty() ? "" : ", ") + name;
  return names.empty() ? "none" : names;
}

}  // namespace

void check_qos_file(const std::filesystem::path& file) {
  const std::string place = file.string();
  const std::string text = read_file(file);
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    throw ConfigError(place + ":" + std::to_string(document.ErrorLineNum()) +
                      ": expected well-formed XML, got " + document.ErrorName());

  std::map<std::string, Found> found;
  if (const auto* root = document.RootElement()) collect_profiles(*root, place, found);
  for (const Required& required : kRequired) {
    const auto profile = found.find(required.name);
    if (profile == found.end())
      throw ConfigError(place + ": profile '" + required.name + "': expected a <" +
                        required.element + "> of this name, got only: " + join_names(found));
    if (profile->second.element != required.element)
      throw ConfigError(place + ":" + std::to_string(profile->second.line) + ": profile '" +
                        required.name + "': expected <" + required.element + ">, got <" +
                        profile->second.element + ">");
  }
}

}  // namespace sls::bus
