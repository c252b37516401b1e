#include "bench/stamps.hpp"

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <thread>
#include <vector>

#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/wait.hpp"
#include "common/bus/node.hpp"

namespace sls::bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr double kFirstSampleLimit_s = 20.0;
constexpr auto kSilenceOfHistory = 300ms;  // after it, the history is complete
constexpr auto kSilenceOfRun = 2s;

struct Stamp {
  std::uint64_t step;
  std::int64_t written_ns;
};

class Listener {
 public:
  Listener(bus::Node& node, const char* profile)
      : states_(node, profile, [this](const States& sample, const bus::PeerId&) {
          const std::chrono::nanoseconds written = states_.written().time_since_epoch();
          const std::lock_guard lock(mutex_);
          stamps_.push_back({sample.step(), written.count()});
          last_ = Clock::now();
        }) {}

  /// True if at least one sample came, and none for `silence`.
  bool is_over(Clock::duration silence) const {
    const std::lock_guard lock(mutex_);
    return !stamps_.empty() && Clock::now() - last_ > silence;
  }
  bool is_empty() const {
    const std::lock_guard lock(mutex_);
    return stamps_.empty();
  }
  /// Without lock: call it when is_over.
  const std::vector<Stamp>& stamps() const { return stamps_; }

 private:
  mutable std::mutex mutex_;
  std::vector<Stamp> stamps_;
  Clock::time_point last_;
  bus::Reader<States> states_;
};

}  // namespace

void print_stamps(const StampsOptions& options) {
  bus::Node node(options.qos_file, options.domain, "bench", "recorder");
  std::vector<Stamp> stamps;
  {
    Listener listener(node, options.is_live ? bus::kLoopReaderProfile : bus::kRecordReaderProfile);
    const auto silence = options.is_live ? Clock::duration(kSilenceOfRun) : kSilenceOfHistory;
    const app::Wait wait(kFirstSampleLimit_s);
    while (!listener.is_over(silence) && app::stop_signal() == 0) {
      if (listener.is_empty() && wait.is_over()) throw app::RunError("stamps: no samples");
      std::this_thread::sleep_for(10ms);
    }
    stamps = listener.stamps();
  }
  for (const Stamp& stamp : stamps)
    std::printf("%llu,%lld\n", static_cast<unsigned long long>(stamp.step),
                static_cast<long long>(stamp.written_ns));
  if (std::fflush(stdout) != 0) throw app::RunError("stamps: stdout cannot be written");
}

}  // namespace sls::bench
