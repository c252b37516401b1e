#include "tools/doctor/doctor.hpp"

#include <unistd.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <thread>

#include "common/bus/environment.hpp"
#include "common/bus/node.hpp"
#include "tools/doctor/diagnosis.hpp"
#include "tools/doctor/other_end.hpp"

namespace sls::doctor {
namespace {

using Clock = std::chrono::steady_clock;

/// Shortest examination. Announcements come every 0.5 s.
constexpr auto kLeastTime = std::chrono::milliseconds(1600);
/// Longest examination. Discovery takes this long on a busy machine; if it takes longer, there is a
/// finding.
constexpr auto kMostTime = std::chrono::milliseconds(5500);
/// Time to wait for samples that show the other machine's clock.
constexpr auto kClockTime = std::chrono::milliseconds(3500);
/// Time for the probes that are sent before the middleware joins.
constexpr auto kFirstProbesTime = std::chrono::milliseconds(1800);
constexpr auto kConnectTime = std::chrono::seconds(1);
constexpr auto kAskInterval = std::chrono::milliseconds(500);
constexpr auto kPause = std::chrono::milliseconds(5);
constexpr const char* kLoopback = "127.0.0.1";

/// Address for probes to programs of this machine.
std::string choose_own_address(const Settings& settings) {
  if (!settings.only_addresses.empty()) return settings.only_addresses.front();
  for (const Interface& interface : find_interfaces())
    if (!interface.is_loopback) return interface.address;
  return kLoopback;
}

/// Addresses of the interfaces by which the multicast probes leave.
std::vector<std::string> choose_multicast_interfaces(const Observations& seen) {
  if (!seen.settings.uses_multicast) return {};
  if (!seen.settings.only_addresses.empty()) return seen.settings.only_addresses;
  if (seen.is_peer_here) return {choose_own_address(seen.settings)};
  UdpSocket towards;
  if (!towards.connect(make_address(seen.peer_address, seen.settings.ports.multicast()))) return {};
  return {towards.find_own_address()};
}

/// True if all expected samples, answers and endpoints have arrived.
bool is_complete(const Observations& seen, bool is_echo_expected, Clock::duration time) {
  const bool is_all_back = std::all_of(seen.echoes.begin(), seen.echoes.end(),
                                       [](const auto& echo) { return echo.second; });
  if (is_echo_expected && !is_all_back) return false;
  for (const Program& program : seen.programs) {
    if (program.is_expected && program.samples == 0) return false;
    if (program.is_expected && !program.is_on_this_host && !program.delay &&
        !seen.probes.clock_ahead && time < kClockTime)
      return false;
  }
  const auto is_met = [&](const bus::PeerId& id) {
    return seen.is_rejected(id) || seen.is_met(id);
  };
  return std::all_of(seen.programs.begin(), seen.programs.end(),
                     [&](const Program& program) {
                       return !is_flying(program.name) ||
                              program.is_secured != seen.settings.is_secured || is_met(program.id);
                     }) &&
         std::all_of(seen.heard.begin(), seen.heard.end(), [&](const Heard& heard) {
           return heard.domain != seen.domain || !is_flying(heard.announcement.name) ||
                  heard.announcement.is_secured != seen.settings.is_secured ||
                  is_met(heard.announcement.sender);
         });
}

/// One examination: prober, listener and observer, and their results so far.
class Examination {
 public:
  explicit Examination(const DoctorOptions& options)
      : options_(options), seen_(look_at_settings(options)), listening_(seen_.settings.ports) {}

  std::vector<Check> run(const std::function<bool()>& is_stopped) {
    start_probes();
    // A host limits how many datagrams it refuses. The probes need these refusals, so they come
    // before the middleware's datagrams.
    if (prober_ && !options_.peer.empty()) work(kFirstProbesTime, is_stopped);
    start_observer();
    work(kMostTime, is_stopped);
    gather();
    if (other_end_) seen_.other_end = other_end_->find_end();
    if (prober_ && !seen_.probes.is_there())
      seen_.is_peer_up = is_host_up(seen_.peer_address, kConnectTime);
    return diagnose(seen_);
  }

 private:
  /// Observations that send nothing to other programs.
  static Observations look_at_settings(const DoctorOptions& options) {
    Observations seen;
    seen.qos_file = options.qos_file.filename().string();
    seen.domain = options.domain;
    seen.user = bus::name_user(::geteuid());
    seen.settings = load_settings(options.qos_file, options.domain, options.identity);
    seen.shared_memory = survey_shared_memory();
    seen.peer = options.peer;
    seen.peer_address = options.peer.empty() ? choose_own_address(seen.settings)
                                             : find_address(options.peer).value_or("");
    seen.is_peer_here = is_own_address(seen.peer_address);
    return seen;
  }

  /// False if shared memory is too small: the middleware would kill this process.
  bool is_room() const {
    return !seen_.settings.uses_shared_memory ||
           (seen_.shared_memory.is_there &&
            seen_.shared_memory.free > calc_shared_memory_need(seen_.settings, 2));
  }

  void start_probes() {
    if (options_.peer.empty()) {
      if (!is_room()) return;
      other_end_.emplace(options_.qos_file, options_.domain, options_.identity);
    }
    if (seen_.peer_address.empty() || (seen_.settings.is_local() && !seen_.is_peer_here)) return;
    prober_.emplace(seen_.settings.ports, seen_.peer_address, choose_multicast_interfaces(seen_),
                    other_end_.has_value());
  }

  void start_observer() {
    if (!is_room()) return;
    try {
      observer_ = std::make_unique<Observer>(
          Observer::Options{options_.qos_file, options_.domain, options_.identity,
                            seen_.is_peer_here ? std::string() : seen_.peer_address, false});
      seen_.is_joined = true;
      seen_.refusal = observer_->refusal();
      seen_.own_endpoints = observer_->own_endpoints();
    } catch (const bus::BusError& error) {
      seen_.join_error = error.what();
    }
  }

  /// Works until everything expected has arrived, at most until `most` after the start.
  void work(Clock::duration most, const std::function<bool()>& is_stopped) {
    for (auto ask_time = Clock::now(); !is_stopped() && Clock::now() < began_ + most;) {
      listening_.work();
      if (prober_) prober_->work();
      if (observer_ && Clock::now() >= ask_time) {
        observer_->ask();
        ask_time = Clock::now() + kAskInterval;
      }
      std::this_thread::sleep_for(kPause);
      if (prober_ && !prober_->is_done()) continue;
      const auto time = Clock::now() - began_;
      if (most == kFirstProbesTime) return;
      if (time < kLeastTime) continue;
      gather();
      const bool is_echo_expected =
          observer_ && seen_.refusal.empty() && (options_.peer.empty() || seen_.probes.is_answered);
      if (!observer_ || is_complete(seen_, is_echo_expected, time)) return;
    }
  }

  void gather() {
    if (prober_) seen_.probes = prober_->results();
    seen_.heard = listening_.heard();
    if (!observer_) return;
    seen_.programs = observer_->programs();
    seen_.endpoints = observer_->endpoints();
    seen_.echoes = observer_->echoes();
  }

  const DoctorOptions& options_;
  const Clock::time_point began_ = Clock::now();
  Observations seen_;
  ListeningPost listening_;
  std::optional<OtherEnd> other_end_;
  std::optional<Prober> prober_;
  std::unique_ptr<Observer> observer_;
};

}  // namespace

std::vector<Check> examine(const DoctorOptions& options, const std::function<bool()>& is_stopped) {
  return Examination(options).run(is_stopped);
}

void answer(const DoctorOptions& options, std::chrono::seconds limit,
            const std::function<bool()>& is_stopped) {
  const Settings settings = load_settings(options.qos_file, options.domain, options.identity);
  ProbeAnswerer answerer(settings.ports);
  Observer observer({options.qos_file, options.domain, options.identity, {}, true});
  const auto end = Clock::now() + limit;
  while (!is_stopped() && Clock::now() < end) {
    answerer.answer(std::chrono::milliseconds(10));
    observer.answer();
  }
}

}  // namespace sls::doctor
