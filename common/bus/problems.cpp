#include "common/bus/problems.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>
#include <vector>

namespace sls::bus {
namespace {

constexpr std::chrono::seconds kWindow(10);

bool begins_with(const std::string& text, const std::string& prefix) {
  return text.compare(0, prefix.size(), prefix) == 0;
}

}  // namespace

void Problems::begin(const std::string& key, const std::string& text,
                     std::optional<Clock::duration> lasting) {
  const std::lock_guard lock(mutex_);
  add(key, text, lasting);
}

void Problems::add(const std::string& key, const std::string& text,
                   std::optional<Clock::duration> lasting) {
  const auto now = Clock::now();
  const auto end = lasting ? std::optional(now + *lasting) : std::nullopt;
  if (const auto known = problems_.find(key); known != problems_.end()) {
    if (known->second.holds(now)) {
      known->second.end = end;
      return;
    }
    problems_.erase(known);
  }
  if (problems_.size() >= kMost) drop_expired(now);
  if (problems_.size() >= kMost) return;
  problems_.emplace(key, Problem{text, ++count_, end});
  version_.fetch_add(1, std::memory_order_release);
  say(text);
}

void Problems::drop_expired(Clock::time_point now) {
  for (auto it = problems_.begin(); it != problems_.end();)
    it = it->second.holds(now) ? std::next(it) : problems_.erase(it);
}

void Problems::end(const std::string& key) {
  const std::lock_guard lock(mutex_);
  if (problems_.erase(key) > 0) version_.fetch_add(1, std::memory_order_release);
}

void Problems::end_all(const std::string& prefix) { replace(prefix, {}); }

void Problems::replace(const std::string& prefix, const std::map<std::string, std::string>& found) {
  const std::lock_guard lock(mutex_);
  auto problem = problems_.lower_bound(prefix);
  while (problem != problems_.end() && begins_with(problem->first, prefix)) {
    if (found.count(problem->first) > 0) {
      ++problem;
    } else {
      problem = problems_.erase(problem);
      version_.fetch_add(1, std::memory_order_release);
    }
  }
  for (const auto& [key, text] : found) add(key, text, std::nullopt);
}

bool Problems::has_any(const std::string& prefix) const {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  auto problem = problems_.lower_bound(prefix);
  while (problem != problems_.end() && begins_with(problem->first, prefix)) {
    if (problem->second.holds(now)) return true;
    ++problem;
  }
  return false;
}

void Problems::rename(const std::string& part, const std::string& from, const std::string& to) {
  const std::lock_guard lock(mutex_);
  for (auto& [key, problem] : problems_) {
    const auto place = problem.text.find(from);
    if (key.find(part) == key.npos || place == problem.text.npos) continue;
    problem.text.replace(place, from.size(), to);
    version_.fetch_add(1, std::memory_order_release);
    say(problem.text);
  }
}

void Problems::say(const std::string& text) {
  const auto now = Clock::now();
  if (now - window_began_ > kWindow) {
    if (left_out_ > 0) spdlog::warn("{} more mistakes of participants", left_out_);
    window_began_ = now, lines_ = 0, left_out_ = 0;
  }
  if (++lines_ > kMostLines)
    ++left_out_;
  else
    spdlog::warn("{}", text);
}

std::string Problems::describe(std::size_t most) const {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  std::vector<const Problem*> held;
  for (const auto& [key, problem] : problems_)
    if (problem.holds(now)) held.push_back(&problem);
  std::sort(held.begin(), held.end(),
            [](const Problem* a, const Problem* b) { return a->number < b->number; });
  std::string text;
  for (std::size_t i = 0; i < held.size(); ++i) {
    const std::string rest = i + 1 < held.size() ? fmt::format(" (+{})", held.size() - i - 1) : "";
    const std::string longer = text + (i > 0 ? "; " : "") + held[i]->text;
    if (longer.size() + rest.size() > most) {
      const std::string left = fmt::format(" (+{})", held.size() - i);
      return i > 0 ? text + left : held[0]->text.substr(0, most - rest.size()) + rest;
    }
    text = longer;
  }
  return text;
}

}  // namespace sls::bus
