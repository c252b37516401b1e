// A reader of a running flight of one vehicle: prints where the load is, ten times a second of
// simulated time, and how many states there were.   my_logger [DOMAIN]
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <thread>

#include "common/bus/node.hpp"
#include "common/bus/qos_file.hpp"

namespace {

using namespace sls;
using namespace std::chrono_literals;

void log_flight(int domain) {
  std::atomic<std::uint64_t> states{0}, end_step{0};
  std::atomic<bool> has_ended{false};
  bus::Node node(bus::default_qos_file(), domain, "my_logger");
  // A recorder's profile: reliable, from the first state on. A display takes kLoopReaderProfile.
  const bus::Reader<VehicleState> state_reader(
      node, bus::kRecorderReaderProfile, [&](const VehicleState& state, const bus::PeerId&) {
        if (state.step() < states) return;  // sent again: a client had not answered in time
        states = state.step() + 1;
        const auto& p = state.p_WL_m();
        if (state.sim_time_ns() % 100'000'000 == 0)
          std::printf("%5.1f s  load at %7.3f %7.3f %7.3f m\n", 1e-9 * state.sim_time_ns(), p[0],
                      p[1], p[2]);
      });
  const bus::Reader<SimStatus> status_reader(
      node, bus::kLatchedReaderProfile, [&](const SimStatus& status, const bus::PeerId&) {
        end_step = status.step();
        has_ended = status.phase() == PHASE_FINISHED || status.phase() == PHASE_FAILED;
      });
  while (!has_ended) std::this_thread::sleep_for(20ms);
  // The topics overtake each other: the last states may be on their way yet.
  for (int i = 0; i < 100 && states <= end_step; ++i) std::this_thread::sleep_for(20ms);
  std::printf("%llu states\n", static_cast<unsigned long long>(states));
}

}  // namespace

int main(int argc, char** argv) {
  try {
    log_flight(argc > 1 ? std::atoi(argv[1]) : 0);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "my_logger: error: %s\n", error.what());
    return 1;
  }
}
