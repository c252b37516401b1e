// Reads a running flight of one vehicle. Prints the load position at every 25th step, and the
// number of states at the end.   my_logger [DOMAIN]
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
  std::uint64_t states = 0;
  std::atomic<bool> has_ended{false};
  bus::Node node(bus::default_qos_file(), domain, "my_logger");
  // With the profile of a recorder, the reader gets all batches in order, from the first one.
  const bus::Reader<RecordBatch> reader(
      node, bus::kRecordReaderProfile, [&](const RecordBatch& batch, const bus::PeerId&) {
        for (const RecordEntry& entry : batch.entries()) {
          if (entry.kind() == AnswerKind::ANSWER_LATE)
            continue;  // answers an earlier step; no new state
          ++states;
          const auto& p = entry.truth().p_WL_m();
          if (entry.step() % 25 == 0)
            std::printf("step %5llu  load at %7.3f %7.3f %7.3f m\n",
                        static_cast<unsigned long long>(entry.step()), p[0], p[1], p[2]);
        }
        has_ended = batch.is_last();
      });
  while (!has_ended) std::this_thread::sleep_for(20ms);
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
