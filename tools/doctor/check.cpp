#include "tools/doctor/check.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace sls::doctor {
namespace {

constexpr std::size_t kNameWidth = 14, kVerdictWidth = 9;

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "ok";
    case Verdict::kFinding:
      return "FAULT";
    case Verdict::kSkipped:
      return "skipped";
  }
  return "unknown";
}

std::string pad(std::string text, std::size_t width) {
  text.resize(std::max(width, text.size() + 1), ' ');
  return text;
}

}  // namespace

bool has_finding(const std::vector<Check>& checks) {
  return std::any_of(checks.begin(), checks.end(),
                     [](const Check& check) { return check.verdict == Verdict::kFinding; });
}

std::string to_line(const Check& check) {
  return pad(check.name, kNameWidth) + pad(to_string(check.verdict), kVerdictWidth) + check.text;
}

std::string to_json(const std::vector<Check>& checks) {
  auto list = nlohmann::json::array();
  for (const Check& check : checks)
    list.push_back(
        {{"name", check.name}, {"verdict", to_string(check.verdict)}, {"text", check.text}});
  // Names of programs and hosts come from the network: bytes that are not UTF-8 are replaced.
  return nlohmann::json{{"ok", !has_finding(checks)}, {"checks", list}}.dump(
      2, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::string join(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    text += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
  return text;
}

}  // namespace sls::doctor
