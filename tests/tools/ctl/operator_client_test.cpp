// The operator's client against a fake server in the test, on a domain of the test's own.
#include "tools/ctl/operator_client.hpp"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <sstream>
#include <thread>

#include "common/app/run_error.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/waiting.hpp"
#include "tools/ctl/show_status.hpp"

namespace sls::ctl {
namespace {

using namespace std::chrono_literals;
using sls::test::find_error;
using sls::test::own_domain;
using sls::test::wait_until;

const std::filesystem::path kQosFile = SLS_SOURCE_DIR "/config/qos/default.xml";

constexpr std::uint64_t kRun = 500;
constexpr std::uint32_t kVehicle = 4;

/// Publishes a status every 20 ms and answers requests by `answer`.
class FakeServer {
 public:
  using Answer = std::function<void(FakeServer&, const SimControl&)>;

  explicit FakeServer(Answer answer, bool listens = true)
      : node_(kQosFile, own_domain(), "fake server"),
        parameters_writer_(node_),
        status_writer_(node_),
        reply_writer_(node_),
        requests_(64),
        answer_(std::move(answer)) {
    if (listens)
      request_reader_.emplace(node_, bus::kLatchedReaderProfile,
                              [this](const SimControl& request, const bus::PeerId&) {
                                if (request.vehicle_id() == kVehicle) requests_.put(request);
                              });
    begin_run(kRun);
    thread_ = std::thread([this] { work(); });
  }

  ~FakeServer() {
    is_over_ = true;
    thread_.join();
  }

  void begin_run(std::uint64_t run_id) {
    Parameters parameters;
    parameters.run_id(run_id);
    parameters.contract_sha256(bus::kContractSha256);
    parameters.vehicles().emplace_back().vehicle_id(kVehicle);
    parameters.scenario_text("name: fake");
    parameters.period_ns(4'000'000);
    parameters_writer_.write(parameters);
    run_id_ = run_id;
  }

  void reply(const SimControl& request, bool accepted, const std::string& reason = "") {
    SimControlReply reply;
    reply.run_id(request.run_id());
    reply.vehicle_id(request.vehicle_id());
    reply.request_id(request.request_id());
    reply.accepted(accepted);
    reply.reason(reason);
    reply.step(step_);
    reply_writer_.write(reply);
  }

  void publish(RunPhase now, const std::string& reason) {
    SimStatus status;
    status.run_id(run_id_);
    status.vehicle_id(kVehicle);
    status.sample_index(samples_++);
    status.phase(now);
    status.reason(reason);
    status.step(step_);
    status_writer_.write(status);
  }

  std::atomic<RunPhase> phase{RunPhase::PHASE_RUNNING};
  std::atomic<bool> is_silent{false};
  std::atomic<int> answered{0};

 private:
  void work() {
    while (!is_over_) {
      const auto request = requests_.take(std::chrono::steady_clock::now() + 20ms);
      ++step_;
      if (!is_silent) publish(phase, "as told");
      if (!request) continue;
      answer_(*this, *request);
      ++answered;
    }
  }

  bus::Node node_;
  bus::Writer<Parameters> parameters_writer_;
  bus::Writer<SimStatus> status_writer_;
  bus::Writer<SimControlReply> reply_writer_;
  app::Mailbox<SimControl> requests_;
  std::optional<bus::Reader<SimControl>> request_reader_;
  const Answer answer_;
  std::atomic<std::uint64_t> run_id_{0};
  std::atomic<std::uint64_t> samples_{0};
  std::atomic<std::uint64_t> step_{100};
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

const FakeServer::Answer kAccept = [](FakeServer& server, const SimControl& request) {
  server.reply(request, true);
};
const FakeServer::Answer kKeepSilent = [](FakeServer&, const SimControl&) {};

ClientOptions make_options(double timeout_s) {
  ClientOptions options;
  options.domain = own_domain();
  options.vehicle_id = kVehicle;
  options.timeout_s = timeout_s;
  return options;
}

class OperatorClientTest : public ::testing::Test {
 protected:
  // Only a failing test waits for this long limit; tests that expect no reply set a short one.
  explicit OperatorClientTest(double timeout_s = 60.0) : client(node, make_options(timeout_s)) {}

  bus::Node node{kQosFile, own_domain(), "operator"};
  OperatorClient client;
};

class ImpatientClientTest : public OperatorClientTest {
 protected:
  ImpatientClientTest() : OperatorClientTest(1.0) {}

  /// The run of the server; tries again until discovery finds it.
  sync::Run find_run() {
    std::optional<sync::Run> run;
    EXPECT_TRUE(wait_until([&] {
      try {
        run = client.wait_for_run();
      } catch (const app::RunError&) {
      }
      return run.has_value();
    }));
    return run.value();
  }
};

TEST_F(OperatorClientTest, ARequestReachesTheServerAndItsReplyComesBack) {
  SimControl seen;
  FakeServer server([&](FakeServer& self, const SimControl& request) {
    seen = request;
    self.reply(request, true);
  });
  const auto run = client.wait_for_run();
  ASSERT_TRUE(run);
  const auto reply = client.ask(*run, ControlAction::ACTION_STEP, 25);
  ASSERT_TRUE(reply);
  EXPECT_TRUE(reply->accepted());
  EXPECT_GE(reply->step(), 100u);
  ASSERT_TRUE(wait_until([&] { return server.answered == 1; }));
  EXPECT_EQ(seen.run_id(), kRun);
  EXPECT_EQ(seen.vehicle_id(), kVehicle);
  EXPECT_EQ(seen.action(), ControlAction::ACTION_STEP);
  EXPECT_EQ(seen.steps(), 25u);
  EXPECT_EQ(seen.operator_name().to_string(), make_operator_name());
}

TEST_F(OperatorClientTest, ARefusalComesBackWithItsReason) {
  FakeServer server([](FakeServer& self, const SimControl& request) {
    SimControl of_another = request;  // replies to other clients are ignored
    of_another.request_id(request.request_id() + 1);
    self.reply(of_another, true);
    self.reply(request, false, "already paused");
  });
  const auto reply = client.ask(client.wait_for_run().value(), ControlAction::ACTION_PAUSE);
  ASSERT_TRUE(reply);
  EXPECT_FALSE(reply->accepted());
  EXPECT_EQ(reply->reason().to_string(), "already paused");
}

TEST_F(OperatorClientTest, ARunThatEndsBeforeItsReplyIsReported) {
  FakeServer server(
      [](FakeServer& self, const SimControl&) { self.phase = RunPhase::PHASE_FAILED; });
  const auto run = client.wait_for_run().value();
  EXPECT_EQ(find_error<app::RunError>([&] { client.ask(run, ControlAction::ACTION_STEP, 10); }),
            "no reply to step: the run has ended: failed, as told");
}

TEST_F(ImpatientClientTest, AServerThatDoesNotReplyIsReported) {
  FakeServer server(kKeepSilent);
  const auto run = find_run();
  const std::string error =
      find_error<app::RunError>([&] { client.ask(run, ControlAction::ACTION_PAUSE); });
  EXPECT_EQ(error.rfind("no reply to pause from the server of run ", 0), 0u) << error;
}

TEST_F(ImpatientClientTest, AServerThatTakesNoRequestsIsReported) {
  FakeServer server(kKeepSilent, false);
  const auto run = find_run();
  const std::string error =
      find_error<app::RunError>([&] { client.ask(run, ControlAction::ACTION_PAUSE); });
  EXPECT_NE(error.find("takes no requests: expected it on sls/control"), error.npos) << error;
}

TEST_F(ImpatientClientTest, StepsEndWithAServerThatFallsSilent) {
  FakeServer server([](FakeServer& self, const SimControl&) { self.is_silent = true; });
  const auto run = find_run();
  const std::string error =
      find_error<app::RunError>([&] { client.ask(run, ControlAction::ACTION_STEP, 10); });
  EXPECT_EQ(error.rfind("no reply to step: server of run ", 0), 0u) << error;
  EXPECT_NE(error.find("silent for "), error.npos) << error;
}

TEST_F(ImpatientClientTest, StepsMayTakeLongerThanTheTimeout) {
  FakeServer server([](FakeServer& self, const SimControl& request) {
    for (int i = 0; i < 100; ++i) {  // 2 s, twice the client's timeout
      self.publish(RunPhase::PHASE_PAUSED, "stepping");
      std::this_thread::sleep_for(20ms);
    }
    self.reply(request, true);
  });
  const auto run = find_run();
  const auto reply = client.ask(run, ControlAction::ACTION_STEP, 10);
  ASSERT_TRUE(reply);
  EXPECT_TRUE(reply->accepted());
}

TEST_F(ImpatientClientTest, WithoutAServerDomainAndVehicleAreNamed) {
  EXPECT_EQ(find_error<app::RunError>([&] { client.wait_for_run(); }),
            "no server for vehicle " + std::to_string(kVehicle) + " on domain " +
                std::to_string(own_domain()) + " within 1 s");
}

TEST_F(OperatorClientTest, AnEndedRunTakesNoRequestsButHasAStatus) {
  FakeServer server(kAccept);
  server.phase = RunPhase::PHASE_FINISHED;
  ASSERT_TRUE(wait_until([&] {
    const auto run = client.wait_for_any_run();
    return run && has_ended(run->status);
  }));
  std::ostringstream out;
  show_status(client, ShowOptions(), out);
  EXPECT_NE(out.str().find("phase       finished: as told\n"), std::string::npos) << out.str();
}

TEST_F(OperatorClientTest, AWatchWithoutTerminalWritesLinesUntilTheRunHasEnded) {
  FakeServer server(kAccept);
  std::ostringstream out;
  ShowOptions options;
  options.watch = true;
  std::atomic<bool> is_over{false};
  std::thread watching([&] {
    show_status(client, options, out);
    is_over = true;
  });
  EXPECT_TRUE(wait_until([&] { return client.wait_for_run().has_value(); }));
  server.phase = RunPhase::PHASE_FINISHED;
  EXPECT_TRUE(wait_until([&] { return is_over.load(); }));
  watching.join();
  const std::string text = out.str();
  const std::string last_line = text.substr(text.rfind('\n', text.size() - 2) + 1);
  EXPECT_NE(last_line.find("| finished: as told |"), text.npos) << text;
  EXPECT_EQ(text.find('\x1b'), text.npos) << "no terminal, no escape sequences";
}

TEST_F(OperatorClientTest, AWatchFollowsAResetToItsSuccessor) {
  FakeServer server(kAccept);
  sync::Run run = client.wait_for_run().value();
  server.phase = RunPhase::PHASE_RESET;
  ASSERT_TRUE(wait_until([&] {
    run = client.refresh(run);
    return run.status->phase() == RunPhase::PHASE_RESET;
  }));
  server.begin_run(kRun + 1);
  server.phase = RunPhase::PHASE_PAUSED;
  EXPECT_TRUE(wait_until([&] {
    run = client.refresh(run);
    return run.parameters.run_id() == kRun + 1 && run.status->phase() == RunPhase::PHASE_PAUSED;
  }));
}

TEST_F(OperatorClientTest, ASnapshotHoldsThePartiesOfTheRunAndTheServersSilence) {
  FakeServer server(kAccept);
  const auto run = client.wait_for_run().value();
  bus::Writer<Participant> writer(node);
  Participant participant;
  participant.run_id(kRun);
  participant.role(ParticipantRole::ROLE_RECORDER);
  participant.name("tape");
  writer.write(participant);
  ASSERT_TRUE(wait_until([&] { return client.make_snapshot(run).participants.size() == 1; }));
  EXPECT_TRUE(wait_until([&] { return client.make_snapshot(run).events.size() == 1; }));
  EXPECT_NE(client.make_snapshot(run).events[0].find(": as told"), std::string::npos);
  server.is_silent = true;
  EXPECT_TRUE(wait_until([&] { return client.make_snapshot(run).silence_s > 0.2; }));
  EXPECT_FALSE(client.make_snapshot(run).server_is_gone);
}

TEST_F(OperatorClientTest, EveryoneIsHeardOnceEachProgramThatWasFoundHasAnnouncedItself) {
  bus::Node found(kQosFile, own_domain(), bus::kClientNode);
  ASSERT_TRUE(wait_until([&] { return node.find_named(bus::kClientNode).size() == 1; }));
  EXPECT_FALSE(client.has_heard_everyone());
  bus::Writer<Participant> writer(found);
  writer.write(Participant());
  EXPECT_TRUE(wait_until([&] { return client.has_heard_everyone(); }));
}

TEST_F(OperatorClientTest, AStatusSaysThatAParticipantMayBeMissing) {
  FakeServer server(kAccept);
  const bus::Node mute(kQosFile, own_domain(), bus::kRecorderNode);
  ASSERT_TRUE(wait_until([&] { return node.find_named(bus::kRecorderNode).size() == 1; }));
  std::ostringstream log, out;
  const auto previous = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  show_status(client, ShowOptions(), out);
  spdlog::set_default_logger(previous);
  EXPECT_NE(log.str().find("not every participant was heard within 3 s"), std::string::npos)
      << log.str();
  EXPECT_NE(out.str().find("no participants"), std::string::npos) << out.str();
}

// A view runs for days, and each reset begins a run.
TEST_F(OperatorClientTest, OnlyTheLastRunsKeepTheirEvents) {
  bus::Writer<SimStatus> writer(node);
  constexpr std::uint64_t kFirst = 1'000, kRuns = 100;
  for (std::uint64_t i = 0; i < kRuns; ++i) {
    SimStatus status;
    status.run_id(kFirst + i);
    status.reason("reset");
    writer.write(status);
  }
  const auto count_events = [&](std::uint64_t run_id) {
    sync::Run run;
    run.parameters.run_id(run_id);
    return client.make_snapshot(run).events.size();
  };
  EXPECT_TRUE(wait_until([&] { return count_events(kFirst + kRuns - 1) == 1; }));
  EXPECT_EQ(count_events(kFirst + kRuns - 64), 1u);
  EXPECT_EQ(count_events(kFirst + kRuns - 65), 0u);
  EXPECT_EQ(count_events(kFirst), 0u);
}

TEST(OperatorNameTest, HoldsUserAndHostAndFitsTheWire) {
  const std::string name = make_operator_name();
  EXPECT_NE(name.find('@'), std::string::npos);
  EXPECT_LE(name.size(), 64u);
}

}  // namespace
}  // namespace sls::ctl
