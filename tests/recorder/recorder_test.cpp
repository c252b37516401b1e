// The recorder over DDS: a fake server and its client on one node, the recorder on another.
#include "recorder/recorder.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "common/app/run_main.hpp"
#include "common/config/sha256.hpp"
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
constexpr std::uint64_t kOtherRun = 0xfedcba9876543210;

/// A server of the synthetic run and its only client.
class FakeFlight {
 public:
  explicit FakeFlight(std::uint64_t run_id) { begin_run(run_id); }

  void begin_run(std::uint64_t run_id) {
    run_id_ = run_id;
    Parameters parameters = make_parameters();
    parameters.run_id(run_id);
    parameters_writer_.write(parameters);
    next_batch_ = 0;
    publish(RunPhase::PHASE_WAITING, 0);
  }

  bool wait_for_recorder() {
    return wait_until([this] {
      keep_alive(RunPhase::PHASE_WAITING);
      const auto recorders = participants_.find(ParticipantRole::ROLE_RECORDER, run_id_);
      return !recorders.empty() && recorders.front().announcement.ready();
    });
  }

  void fly(std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t step = from; step <= to; ++step) write_step(step);
    publish(RunPhase::PHASE_RUNNING, to);
  }
  void write_step(std::uint64_t step) {
    write(record_writer_, make_batch(next_batch_++, {make_entry(step)}, step == kLastStep));
  }
  void announce_library(const std::string& sha256) {
    Participant pilot;
    pilot.role(ParticipantRole::ROLE_CONTROLLER);
    pilot.name(kPilot);
    pilot.library_sha256(sha256);
    write(participant_writer_, pilot);
  }

  void publish(RunPhase phase, std::uint64_t step) {
    write(status_writer_, make_status(phase, step));
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
      const auto recorders = participants_.find(ParticipantRole::ROLE_RECORDER, run_id_);
      return !recorders.empty() && recorders.front().announcement.last_complete_step() >= step;
    });
  }

 private:
  template <class Message>
  void write(bus::Writer<Message>& writer, Message message) {
    message.run_id(run_id_);
    writer.write(message);
  }

  bus::Node node_{kQosFile, own_domain(), "server"};
  std::uint64_t run_id_ = 0;
  std::uint64_t next_batch_ = 0;
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

  Json read_manifest(const fs::path& folder) {
    return Json::parse(read_bytes(folder / "manifest.json"));
  }
  void expect_whole(const fs::path& folder) {
    const fs::path whole = folder_ / "whole";
    if (!fs::exists(whole)) {
      fs::create_directory(whole);
      record_flight(whole);
    }
    const OpenedRecording flight = open_recording(folder);
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
  FakeFlight flight(kRunId);
  start();
  ASSERT_TRUE(flight.wait_for_recorder());
  flight.announce_library(std::string(64, 'b'));
  flight.fly(0, kLastStep - 1);
  ASSERT_TRUE(flight.is_recorded_up_to(kLastStep - 1));
  flight.write_step(kLastStep);
  flight.publish(RunPhase::PHASE_FINISHED, kLastStep);
  join();
  EXPECT_EQ(error_, "no error");
  expect_whole(out_);
  EXPECT_EQ(read_manifest(out_).at("libraries"),
            Json({{"controllers", {{kPilot, std::string(64, 'b')}}}}));
}

// Every participant can write batches of the run; only those of its server count.
TEST_F(RecorderTest, BatchesOfOtherSendersDoNotCount) {
  FakeFlight flight(kRunId);
  start();
  ASSERT_TRUE(flight.wait_for_recorder());
  bus::Node node(kQosFile, own_domain(), "stranger");
  bus::Writer<RecordBatch> writer(node);
  ASSERT_TRUE(wait_until([&] { return !writer.matched().empty(); }));
  writer.write(make_batch(0, {make_entry(200)}, true));
  ASSERT_TRUE(writer.wait_for_acknowledgments(5s));
  flight.fly(0, kLastStep);
  flight.publish(RunPhase::PHASE_FINISHED, kLastStep);
  join();
  EXPECT_EQ(error_, "no error");
  expect_whole(out_);
}

TEST_F(RecorderTest, AResetsNewRunGoesIntoASubfolder) {
  FakeFlight flight(kRunId);
  start();
  ASSERT_TRUE(flight.wait_for_recorder());
  flight.fly(0, 100);
  flight.publish(RunPhase::PHASE_RESET, 100);
  flight.begin_run(kOtherRun);
  ASSERT_TRUE(flight.wait_for_recorder());
  flight.fly(0, kLastStep);
  flight.publish(RunPhase::PHASE_FINISHED, kLastStep);
  join();
  EXPECT_EQ(error_, "no error");
  EXPECT_EQ(read_manifest(out_).at("outcome"), "reset");
  EXPECT_EQ(read_manifest(out_).at("missing"), Json::array());
  expect_whole(out_ / "run-fedcba9876543210");
}

}  // namespace
}  // namespace sls::record
