// A reader of sls/record that acknowledges nothing, and a QoS file whose writer waits for it
// (KEEP_ALL): the server stays operable and ends in bounded time.
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include "common/app/run_error.hpp"
#include "common/bus/qos_file.hpp"
#include "common/bus/queued_writer.hpp"
#include "common/config/vehicle_ids.hpp"
#include "control_client/client.hpp"
#include "sim_server/server.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/text.hpp"
#include "tests/support/waiting.hpp"

namespace sls::sim {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using test::own_domain;
using test::wait_until;

/// The default QoS file with such a writer. Within a process Fast DDS would else pass samples
/// without acknowledgements.
fs::path find_qos_file() {
  static const test::TemporaryFolder folder;
  static const fs::path file = [] {
    const std::string text = test::read_bytes(bus::default_qos_file());
    test::write_bytes(folder / "blocking.xml", test::replace_once(text, "  <profiles>\n", R"(
      <library_settings><intraprocess_delivery>OFF</intraprocess_delivery></library_settings>
      <profiles>
        <data_writer profile_name="sls_record_writer">
          <topic>
            <historyQos><kind>KEEP_ALL</kind></historyQos>
            <resourceLimitsQos>
              <max_samples>4</max_samples>
              <max_instances>1</max_instances>
              <max_samples_per_instance>4</max_samples_per_instance>
              <allocated_samples>1</allocated_samples>
            </resourceLimitsQos>
          </topic>
          <qos>
            <reliability>
              <kind>RELIABLE</kind>
              <max_blocking_time><sec>1</sec></max_blocking_time>
            </reliability>
            <durability><kind>TRANSIENT_LOCAL</kind></durability>
            <data_sharing><kind>OFF</kind></data_sharing>
          </qos>
          <historyMemoryPolicy>DYNAMIC_REUSABLE</historyMemoryPolicy>
        </data_writer>
)"));
    return folder / "blocking.xml";
  }();
  return file;
}

/// A recorder that hangs: its handler of the first batch returns at the end of the test.
class StuckReader {
 public:
  ~StuckReader() { release(); }
  void release() {
    {
      const std::lock_guard lock(mutex_);
      is_released_ = true;
    }
    released_.notify_all();
  }
  bool is_matched() const { return !reader_.matched().empty(); }

 private:
  void hang() {
    std::unique_lock lock(mutex_);
    released_.wait(lock, [this] { return is_released_; });
  }
  std::mutex mutex_;
  std::condition_variable released_;
  bool is_released_ = false;
  bus::Node node_{find_qos_file(), own_domain(), "stuck"};
  bus::Reader<RecordBatch> reader_{node_, bus::kRecordReaderProfile,
                                   [this](const RecordBatch&, const bus::PeerId&) { hang(); }};
};

/// More than could be waited for one by one: each refused sample takes 1 s.
constexpr std::size_t kManySamples = 1000;

/// Runs `act` on a thread of its own; false if it does not end. The reader is then released, so
/// that it can.
bool ends(StuckReader& reader, const std::function<void()>& act) {
  std::atomic<bool> is_over{false};
  std::thread acting([&] {
    act();
    is_over = true;
  });
  const bool ended = wait_until([&] { return is_over.load(); });
  reader.release();
  acting.join();
  return ended;
}

TEST(BlockedRecordTest, TheEndOfTheStreamDoesNotWaitForEachBatch) {
  StuckReader reader;
  bus::Node node(find_qos_file(), own_domain(), "server");
  bus::Writer<RecordBatch> writer(node);
  ASSERT_TRUE(wait_until([&] { return reader.is_matched() && !writer.matched().empty(); }));
  RecordStream stream(writer, 100, 1);  // less than an entry: each one is a batch
  const model::StepRecord record{};
  stream.add_step(std::vector<model::StepRecord>(kManySamples, record));
  EXPECT_TRUE(ends(reader, [&] { stream.end(); }));
  EXPECT_GT(stream.lost(), kManySamples / 2) << "the batches that were not tried count, too";
  EXPECT_LE(stream.lost(), kManySamples);
}

TEST(BlockedRecordTest, TheEndOfAQueuedWriterDoesNotWaitForEachMessage) {
  StuckReader reader;
  bus::Node node(find_qos_file(), own_domain(), "server");
  bus::Writer<RecordBatch> writer(node);
  ASSERT_TRUE(wait_until([&] { return reader.is_matched() && !writer.matched().empty(); }));
  std::optional<bus::QueuedWriter<RecordBatch>> queue(std::in_place, writer, kManySamples);
  for (std::size_t i = 0; i < kManySamples; ++i) queue->write(RecordBatch());
  EXPECT_TRUE(ends(reader, [&] { queue.reset(); }));
}

/// A flight in lockstep of many vehicles, which soon fill the queue of the records.
class BlockedFlightTest : public testing::Test {
 protected:
  static config::Scenario make_scenario() {
    return config::parse_scenario(R"(
name: blocked
vehicles: 64
vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }
plant: { model: analytic, step_s: 0.004, initial: { load_position_m: [0, 0, -0.5] } }
sync: { mode: lockstep, period_s: 0.004, wait_for: { controllers: 1, recorders: 0, timeout_s: 60 },
        wait: { recorder: { policy: wait, deadline_s: 1000 } } }
controller: { gains: { lqr: { horizontal: 10, vertical: 5 } }, force_limit_n: 200 }
mission:
  - hold: { position_m: [0, 0, -0.5] }
    for_s: 100000
)",
                                  "blocked.yaml");
  }

  /// Flies until the server ends, with the client of the test. Returns its error.
  std::string fly(const std::function<void()>& disturb) {
    const config::Scenario scenario = make_scenario();
    const auto ids = config::parse_vehicle_ids("all", scenario.vehicles.size());
    std::atomic<bool> is_stopped{false};
    std::thread client([&] {
      control::ClientOptions options;
      options.is_stopped = [&] { return is_stopped.load(); };
      bus::Node node(find_qos_file(), own_domain(), "client");
      try {
        control::Client(node, scenario, ids, options).run();
      } catch (const app::RunError&) {  // the run fails
      }
    });
    std::thread disturbing(disturb);
    std::string error;
    EXPECT_TRUE(ends(reader_, [&] {
      bus::Node node(find_qos_file(), own_domain(), "server");
      Server server(node, {scenario, ids}, 1);
      try {
        server.run();
      } catch (const app::RunError& failure) {
        error = failure.what();
      }
    }));
    is_stopped = true;
    client.join();
    disturbing.join();
    return error;
  }

  StuckReader reader_;
};

TEST_F(BlockedFlightTest, TheServerReportsTheWaitAndObeysAnOperatorMeanwhile) {
  const std::string error = fly([] {
    bus::Node node(find_qos_file(), own_domain(), "operator");
    bus::Writer<SimControl> requests(node);
    std::mutex mutex;
    std::optional<SimStatus> waiting;
    const bus::Reader<SimStatus> reader(
        node, bus::kLatchedReaderProfile, [&](const SimStatus& status, const bus::PeerId&) {
          const std::lock_guard lock(mutex);
          if (test::holds(status.reason().to_string(), "waiting for: recorder: the queue"))
            waiting = status;
        });
    ASSERT_TRUE(wait_until([&] {
      const std::lock_guard lock(mutex);
      return waiting.has_value() && !requests.matched().empty();
    }));
    SimControl request;
    request.run_id(waiting->run_id());
    request.request_id(1);
    request.operator_name("anna@test");
    request.action(ControlAction::ACTION_STOP);
    requests.write(request);
    requests.wait_for_acknowledgments(10s);
  });
  EXPECT_EQ(error, "stopped by anna@test");
}

}  // namespace
}  // namespace sls::sim
