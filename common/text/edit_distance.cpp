#include "common/text/edit_distance.hpp"

#include <algorithm>
#include <numeric>

namespace sls::text {

std::size_t calc_edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before_last, last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = a[i - 1] == b[j - 1];
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    before_last = last;
    last = row;
  }
  return last[b.size()];
}

std::optional<std::string> find_similar(const std::string& key,
                                        const std::vector<std::string>& known) {
  constexpr std::size_t kLongestKey = 64;  // no suggestion for longer keys
  if (key.empty() || key.size() > kLongestKey) return std::nullopt;
  std::optional<std::string> similar;
  std::size_t least = std::max<std::size_t>(2, key.size() / 3) + 1;
  for (const std::string& name : known) {
    const bool unit_forgotten = key.size() >= 3 && name.compare(0, key.size(), key) == 0;
    const std::size_t distance = unit_forgotten ? 0 : calc_edit_distance(key, name);
    if (distance >= least) continue;
    least = distance;
    similar = name;
  }
  return similar;
}

}  // namespace sls::text
