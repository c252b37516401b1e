/// Replaces a function of Fast DDS 3 in all programs that have a Node. These programs then keep
/// receiving when another participant leaves while this one announces itself.
///
/// Of each participant a thread for timers announces it and then waits for the lock of the
/// discovered participants, to choose when it announces it again. A thread that receives removes
/// the writers of one that leaves: it holds that lock and waits until no timer is being served.
/// Both wait for ever (README.md, trap 39). So here another thread chooses that time; if it comes
/// late, the next announcement comes after the time that was chosen before.
///
/// Upstream: #6502 (open, 3.6 has it, too). To be deleted when the timer's thread does not wait for
/// that lock.
#include "fastdds_announcements.hpp"

#include <dlfcn.h>
#include <pthread.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <set>
#include <string_view>
#include <thread>

namespace eprosima::fastdds::rtps {

/// Discovery of one participant; only the replaced function counts here.
class __attribute__((visibility("default"))) PDP {
 public:
  void set_next_announcement_interval();
};

}  // namespace eprosima::fastdds::rtps

namespace sls::bus {
namespace {

using eprosima::fastdds::rtps::PDP;

void call_original(PDP* discovery) {
  constexpr const char* kName = "_ZN8eprosima7fastdds4rtps3PDP30set_next_announcement_intervalEv";
  static const auto original = reinterpret_cast<void (*)(PDP*)>(dlsym(RTLD_NEXT, kName));
  original(discovery);
}

/// Id of the participant whose timers this thread serves, from its name; -1 in other threads.
int find_timed_participant() {
  constexpr std::string_view kTimers = "dds.ev.";
  std::array<char, 16> name{};
  pthread_getname_np(pthread_self(), name.data(), name.size());
  int id = -1;
  if (std::string_view(name.data()).rfind(kTimers, 0) == 0)
    std::from_chars(name.data() + kTimers.size(), name.data() + std::strlen(name.data()), id);
  return id;
}

class Announcements {
 public:
  /// Never destroyed, because the middleware may still announce while the process exits.
  static Announcements& of_process() {
    static auto& instance = *new Announcements;
    return instance;
  }

  void choose_later(PDP* discovery, int participant) {
    const std::lock_guard lock(mutex_);
    if (leaving_.count(participant) != 0) return;
    if (!is_started_) std::thread([this] { run(); }).detach();
    is_started_ = true;
    waiting_.push_back({discovery, participant});
    changed_.notify_all();
  }

  /// Waits for nothing of other participants, one of which may be blocked.
  void begin_leaving(int participant) {
    std::unique_lock lock(mutex_);
    leaving_.insert(participant);
    waiting_.erase(
        std::remove_if(waiting_.begin(), waiting_.end(),
                       [&](const Choice& one) { return one.participant == participant; }),
        waiting_.end());
    changed_.wait(lock, [&] { return served_ != participant; });
  }

  void end_leaving(int participant) {
    const std::lock_guard lock(mutex_);
    leaving_.erase(participant);
  }

 private:
  struct Choice {
    PDP* discovery;
    int participant;
  };

  [[noreturn]] void run() {
    pthread_setname_np(pthread_self(), "sls.announce");  // not that of the thread that starts it
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return !waiting_.empty(); });
      const Choice choice = waiting_.front();
      waiting_.pop_front();
      served_ = choice.participant;
      lock.unlock();
      call_original(choice.discovery);
      lock.lock();
      served_ = -1;
      changed_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Choice> waiting_;
  int served_ = -1;  ///< participant of the choice that is being made; -1: none
  std::set<int> leaving_;
  bool is_started_ = false;
};

}  // namespace

// Bytes 8 and 9 of a GUID are the participant's id, which also ends the name of its timers' thread.
LeavingScope::LeavingScope(const dds::DomainParticipant& participant)
    : participant_(participant.guid().guidPrefix.value[8] | participant.guid().guidPrefix.value[9]
                                                                << 8) {
  Announcements::of_process().begin_leaving(participant_);
}
LeavingScope::~LeavingScope() { Announcements::of_process().end_leaving(participant_); }

}  // namespace sls::bus

void eprosima::fastdds::rtps::PDP::set_next_announcement_interval() {
  const int participant = sls::bus::find_timed_participant();
  if (participant >= 0)
    sls::bus::Announcements::of_process().choose_later(this, participant);
  else
    sls::bus::call_original(this);
}
