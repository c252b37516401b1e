#include "common/bus/fastdds/refusals.hpp"

#include <spdlog/spdlog.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <utility>

#include "common/bus/fastdds/middleware_log.hpp"

namespace sls::bus {
namespace {

constexpr std::chrono::seconds kWindow(10);

/// Replaces those messages of Fast DDS that give the user no hint.
std::string explain(const std::string& message) {
  const auto has = [&](const char* text) { return message.find(text) != std::string::npos; };
  if (has("verification of the permissions file") ||     // 2.9
      has("Cannot read as PKCS7 the permissions file"))  // 3.1, also of one without a signature
    return "its permissions are not signed by our permissions authority";
  if (has("doesn't found in its permissions file"))
    return "its permissions are not for its certificate, or not valid now";
  if (has("PermissionsCA differs")) return "its permissions are of another authority";
  // "Invalidation error of certificate  (certificate has expired)", "Error validating … GUID (…)."
  const std::string text = trim_place(message);
  const auto begin = text.find('(');
  if (!has("rror") || begin == std::string::npos) return text;
  std::string reason = text.substr(begin + 1, text.rfind(')') - begin - 1);
  if (has("of certificate")) reason = "its certificate is not accepted (" + reason + ")";
  return reason;
}

/// Names this machine since its start and the namespace of its processes.
const std::string& name_machine() {
  static const std::string name = [] {
    std::string boot;
    std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), boot);
    std::error_code error;
    return boot + " " + std::filesystem::read_symlink("/proc/self/ns/pid", error).string() + " ";
  }();
  return name;
}

/// True if that process was on this machine and has ended, also if its parent has not waited for
/// it.
bool has_ended(const std::string& process) {
  const std::string& machine = name_machine();
  const std::string number = process.substr(std::min(process.size(), machine.size()));
  if (process.compare(0, machine.size(), machine) != 0 || number.empty() ||
      number.find_first_not_of("0123456789") != number.npos)
    return false;
  std::error_code error;
  static_cast<void>(std::filesystem::read_symlink("/proc/" + number + "/exe", error));
  return error == std::errc::no_such_file_or_directory;
}

}  // namespace

std::string Refusals::name_process() { return name_machine() + std::to_string(::getpid()); }

Refusals::~Refusals() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  changed_.notify_one();
  if (watcher_.joinable()) watcher_.join();
}

Refusals& Refusals::of_process() {
  static auto& instance = *new Refusals;
  return instance;
}

void Refusals::note_discovered(const std::string& guid, const std::string& description,
                               const std::string& claim, const std::string& process) {
  const std::lock_guard lock(mutex_);
  if (known_.size() >= kMostKnown) return;
  const auto [known, is_new] = known_.emplace(guid, description);
  if (!is_new) {  // Fast DDS 3 accepts a participant, then discovers it; announcements recur
    if (known->second.empty()) known->second = description;
    return;
  }
  if (claim.empty()) return;
  pending_.emplace(guid, Pending{Clock::now() + kTimeToProve, claim, process});
  if (!watcher_.joinable()) watcher_ = std::thread([this] { watch(); });
  changed_.notify_one();
}

void Refusals::note_accepted(const std::string& guid) {
  const std::lock_guard lock(mutex_);
  pending_.erase(guid);
  if (known_.size() < kMostKnown) known_.emplace(guid, "");
}

void Refusals::note_gone(const std::string& guid) {
  const std::lock_guard lock(mutex_);
  known_.erase(guid);
  pending_.erase(guid);
  reported_.erase(guid);
}

void Refusals::note_refused(const std::string& guid, const std::string& cause) {
  if (cause.empty()) MiddlewareLog::flush();
  const std::lock_guard lock(mutex_);
  const std::string logged = std::exchange(cause_, {});
  if (!cause.empty() || !logged.empty()) report(guid, cause.empty() ? explain(logged) : cause);
}

void Refusals::note_cause(const std::string& message) {
  if (message.find("Error verifying certificate") == 0) return;  // the line before has the reason
  const std::lock_guard lock(mutex_);
  const auto named = std::find_if(known_.begin(), known_.end(), [&](const auto& participant) {
    return message.find(participant.first) != std::string::npos;
  });
  if (named != known_.end())
    report(named->first, explain(message));
  else
    cause_ = message;
}

void Refusals::watch() {
  std::unique_lock lock(mutex_);
  while (!is_over_) {
    const auto next = std::min_element(
        pending_.begin(), pending_.end(),
        [](const auto& a, const auto& b) { return a.second.deadline < b.second.deadline; });
    if (next == pending_.end()) {
      changed_.wait(lock);
    } else if (Clock::now() < next->second.deadline) {
      const auto deadline = next->second.deadline;  // `next` may be erased meanwhile
      changed_.wait_until(lock, deadline);
    } else if (has_ended(next->second.process)) {
      pending_.erase(next);
    } else {
      report(next->first, "no proof of an identity that holds here within " +
                              std::to_string(kTimeToProve.count()) + " s; it claims " +
                              next->second.claim);
    }
  }
}

void Refusals::report(const std::string& participant, const std::string& cause) {
  const std::string guid = participant;  // may be a key that is erased here
  pending_.erase(guid);
  if (reported_.size() >= kMostKnown) reported_.clear();
  if (!reported_.insert(guid).second) return;
  const auto now = Clock::now();
  if (now - window_began_ > kWindow) {
    if (left_out_ > 0) spdlog::warn("refused {} more participants", left_out_);
    window_began_ = now, lines_ = 0, left_out_ = 0;
  }
  if (++lines_ > kMostLines) {
    ++left_out_;
    return;
  }
  const auto found = known_.find(guid);
  const bool is_described = found != known_.end() && !found->second.empty();
  spdlog::warn("refused {}: {}", is_described ? found->second : "participant " + guid, cause);
}

}  // namespace sls::bus
