// The recorder over DDS: a fake server and its client on one node, the recorder on another.
#include "recorder/recorder.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "common/text/sha256.hpp"
#include "recorder/verification.hpp"
#include "tests/recorder/flights.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/waiting.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using namespace test;
using sls::test::own_domain;
using sls::test::read_bytes;
using sls::test::wait_until;
using Json = nlohmann::json;

const fs::path kQosFile = SLS_SOURCE_DIR "/config/qos/default.xml";

/// A server of the synthetic run and its only client.
class FakeFlight {
 public:
  FakeFlight() {
    parameters_writer_.write(make_parameters());
    publish(RunPhase::PHASE_WAITING, 0);
  }

  bool wait_for_recorder() {
    return wait_until([this] {
      keep_alive(RunPhase::PHASE_WAITING);
      const auto recorders = participants_.find(ParticipantRole::ROLE_RECORDER, kRunId);
      return !recorders.empty() && recorders.front().announcement.ready();
    });
  }

  void fly(std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t step = from; step <= to; ++step) write_step(step);
    publish(RunPhase::PHASE_RUNNING, to);
  }
  void write_step(std::uint64_t step) {
    record_writer_.write(make_batch(step, {make_entry(step)}, step == kLastStep));
  }
  void announce_library(const std::string& sha256) {
    Participant pilot;
    pilot.role(ParticipantRole::ROLE_CONTROLLER);
    pilot.name(kPilot);
    pilot.library_sha256(sha256);
    pilot.run_id(kRunId);
    participant_writer_.write(pilot);
  }

  void publish(RunPhase phase, std::uint64_t step) {
    status_writer_.write(make_status(phase, step));
    publish_time_ = std::chrono::steady_clock::now();
  }
  /// Publishes a status at most every 400 ms, as servers do: the history must still hold all
  /// samples for a late recorder.
  void keep_alive(RunPhase phase) {
    if (std::chrono::steady_clock::now() - publish_time_ >= 400ms) publish(phase, 0);
  }

  bool is_recorded_up_to(std::int64_t step) {
    return wait_until([&] {
      keep_alive(RunPhase::PHASE_RUNNING);
      const auto recorders = participants_.find(ParticipantRole::ROLE_RECORDER, kRunId);
      return !recorders.empty() && recorders.front().announcement.last_complete_step() >= step;
    });
  }

 private:
  bus::Node node_{kQosFile, own_domain(), "server"};
  std::chrono::steady_clock::time_point publish_time_;
  bus::ParticipantDirectory participants_{node_};
  bus::Writer<Parameters> parameters_writer_{node_};
  bus::Writer<SimStatus> status_writer_{node_};
  bus::Writer<RecordBatch> record_writer_{node_};
  bus::Writer<Participant> participant_writer_{node_};
};

class RecorderTest : public testing::Test {
 protected:
  RecorderTest() {
    options_.folder = out_;
    fs::create_directory(out_);
  }
  ~RecorderTest() override { join(); }

  void start() {
    thread_ = std::thread([this] {
      try {
        bus::Node node(kQosFile, own_domain(), "recorder");
        Recorder(node, options_).run();
      } catch (const std::exception& error) {
        error_ = error.what();
      }
    });
  }
  /// Waits for the end of the recorder; `error_` then has its error.
  void join() {
    if (thread_.joinable()) thread_.join();
  }

  void expect_whole() {
    const fs::path whole = folder_ / "whole";
    fs::create_directory(whole);
    record_flight(whole);
    const OpenedRecording flight = open_recording(out_);
    const auto difference = find_first_difference(open_recording(whole), flight);
    EXPECT_FALSE(difference) << difference->text;
    EXPECT_TRUE(flight.manifest().complete);
    EXPECT_TRUE(inspect(flight).problems.empty());
  }

  const sls::test::TemporaryFolder folder_;
  const fs::path out_ = folder_ / "out";
  RecorderOptions options_;
  std::thread thread_;
  std::string error_ = "no error";
};

TEST_F(RecorderTest, RecordsARunToItsEnd) {
  FakeFlight flight;
  start();
  ASSERT_TRUE(flight.wait_for_recorder());
  flight.announce_library(std::string(64, 'b'));
  flight.fly(0, kLastStep - 1);
  ASSERT_TRUE(flight.is_recorded_up_to(kLastStep - 1));
  flight.write_step(kLastStep);
  flight.publish(RunPhase::PHASE_FINISHED, kLastStep);
  join();
  EXPECT_EQ(error_, "no error");
  expect_whole();
  EXPECT_EQ(Json::parse(read_bytes(out_ / "manifest.json")).at("libraries"),
            Json({{"controllers", {{kPilot, std::string(64, 'b')}}}}));
}

}  // namespace
}  // namespace sls::record
