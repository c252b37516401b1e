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

#include <array>
#include <condition_variable>
#include <deque>
#include <mutex>
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

/// True in the thread of a participant's timers.
bool is_timer_thread() {
  std::array<char, 16> name{};
  pthread_getname_np(pthread_self(), name.data(), name.size());
  return std::string_view(name.data()).rfind("dds.ev.", 0) == 0;
}

class Announcements {
 public:
  /// Never destroyed, because the middleware may still announce while the process exits.
  static Announcements& of_process() {
    static auto& instance = *new Announcements;
    return instance;
  }

  void choose_later(PDP* discovery) {
    const std::lock_guard lock(mutex_);
    if (leaving_ > 0) return;
    if (!is_started_) std::thread([this] { run(); }).detach();
    is_started_ = true;
    waiting_.push_back(discovery);
    changed_.notify_all();
  }

  void begin_leaving() {
    std::unique_lock lock(mutex_);
    ++leaving_;
    changed_.wait(lock, [this] { return waiting_.empty(); });
  }

  void end_leaving() {
    const std::lock_guard lock(mutex_);
    --leaving_;
  }

 private:
  [[noreturn]] void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return !waiting_.empty(); });
      PDP* const discovery = waiting_.front();
      lock.unlock();
      call_original(discovery);
      lock.lock();
      waiting_.pop_front();
      changed_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<PDP*> waiting_;  ///< the first is being served
  int leaving_ = 0;
  bool is_started_ = false;
};

}  // namespace

LeavingScope::LeavingScope() { Announcements::of_process().begin_leaving(); }
LeavingScope::~LeavingScope() { Announcements::of_process().end_leaving(); }

}  // namespace sls::bus

void eprosima::fastdds::rtps::PDP::set_next_announcement_interval() {
  if (sls::bus::is_timer_thread())
    sls::bus::Announcements::of_process().choose_later(this);
  else
    sls::bus::call_original(this);
}
