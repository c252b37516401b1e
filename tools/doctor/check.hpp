/// The doctor's output: one line per check.
#pragma once

#include <string>
#include <vector>

namespace sls::doctor {

enum class Verdict {
  kOk,
  kFinding,
  kSkipped,  ///< could not be tried, or does not apply to this QoS file
};

struct Check {
  std::string name;  ///< "multicast"
  Verdict verdict = Verdict::kOk;
  std::string text;  ///< the fact; for a finding also its consequence and the remedy
};

bool has_finding(const std::vector<Check>& checks);

/// One line: name, verdict, text.
std::string to_line(const Check& check);

/// {"ok": false, "checks": [{"name": "multicast", "verdict": "FAULT", "text": "…"}, …]}
std::string to_json(const std::vector<Check>& checks);

/// "a", "a and b", "a, b and c".
std::string join(const std::vector<std::string>& words);

}  // namespace sls::doctor
