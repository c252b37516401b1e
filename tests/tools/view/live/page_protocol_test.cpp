// Feed, operator and sessions of pages, with a fake server.
#include "tools/view/live/page_protocol.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "tests/support/own_domain.hpp"
#include "tests/tools/view/live/binary_message.hpp"
#include "tests/tools/view/live/fake_connection.hpp"
#include "tests/tools/view/live/fake_server.hpp"
#include "tests/tools/view/live/server_thread.hpp"

namespace sls::view {
namespace {

using test::FakeConnection;
using test::FakeServer;
using test::find_kind;
using test::make_batch;
using test::make_parameters;

struct Page {
  explicit Page(Protocol& protocol) : session(protocol.make_session(connection)) {}
  void say(const std::string& text) { session->receive(MessageKind::kText, text); }
  std::size_t count(const std::string& op) const { return connection.find(op).size(); }
  bool has_binary(std::uint32_t kind) const {
    for (const std::string& message : connection.binary)
      if (find_kind(message) == kind) return true;
    return false;
  }
  FakeConnection connection;
  std::unique_ptr<Session> session;
};

class PageProtocolTest : public testing::Test {
 protected:
  explicit PageProtocolTest(bool may_ask = true, double timeout_s = 5.0)
      : requests(node, 0, thread.post(), may_ask, timeout_s),
        protocol(make_page_protocol(feed, requests, {domain.number(), 0, true})) {}

  bool wait_until(const std::function<bool()>& is_met) { return thread.wait_until(is_met); }
  bool wait_for_record(const FakeServer& server) {
    return wait_until([&] { return server.is_record_read_by(node); });
  }
  /// Writes `messages` until `is_met`: the feed reads best-effort, and a sample is lost while only
  /// one of both sides knows the other.
  template <class... Messages>
  bool write_until(const std::function<bool()>& is_met, FakeServer& server,
                   const Messages&... messages) {
    return wait_until([&] {
      (server.write(messages), ...);
      return is_met();
    });
  }

  test::OwnDomain domain;
  test::ServerThread thread;
  bus::Node node{test::kQosFile, domain.number(), "viewer", "", bus::Transports::kNetwork};
  Feed feed{node, 0, thread.post()};
  Operator requests;
  Protocol protocol;
};

class PageOfAViewerTest : public PageProtocolTest {
 protected:
  PageOfAViewerTest() : PageProtocolTest(false) {}
};

class PageWithoutServerTest : public PageProtocolTest {
 protected:
  PageWithoutServerTest() : PageProtocolTest(true, 0.2) {}
};

// --- messages to a page --------------------------------------------------------------------------

TEST_F(PageProtocolTest, APageGetsAGreetingAndTheMissingParticipants) {
  Page page(protocol);
  ASSERT_EQ(page.connection.texts.size(), 2u);
  const auto& hello = page.connection.texts[0];
  EXPECT_EQ(hello.at("op"), "hello");
  EXPECT_EQ(hello.at("domain"), domain.number());
  EXPECT_EQ(hello.at("may_operate"), true);
  EXPECT_EQ(hello.at("needs_token"), false);
  const auto& no_run = page.connection.texts[1];
  EXPECT_EQ(no_run.at("op"), "no_run");
  EXPECT_NE(no_run.at("command").get<std::string>().find("./sls run"), std::string::npos);
}

TEST_F(PageProtocolTest, ARunItsStatusItsEventsAndItsStatesCome) {
  Page page(protocol);
  FakeServer server(domain.number(), 0xabcd);
  ASSERT_TRUE(wait_until([&] { return page.count("status") > 0 && page.count("event") > 0; }));
  EXPECT_EQ(page.connection.find("run").at(0).at("run").at("run_id"), "000000000000abcd");
  EXPECT_EQ(page.connection.find("event").at(0).at("text"), "waiting for: controller");
  const auto waiting = page.connection.find("status").front();
  EXPECT_EQ(waiting.at("phase"), "waiting");
  EXPECT_EQ(waiting.at("waiting_for"), "waiting for: controller");

  server.publish(RunPhase::PHASE_RUNNING, "participants are ready", 50);
  ASSERT_TRUE(wait_until([&] {
    return page.connection.find("status").back().at("phase") == "running" &&
           page.count("event") == 2;
  }));
  EXPECT_EQ(page.connection.find("event").at(1).at("step"), 50);
  EXPECT_EQ(page.connection.find("event").at(1).at("sim_time_s"), 0.2);
  ASSERT_TRUE(write_until([&] { return page.has_binary(1) && page.has_binary(2); }, server,
                          make_batch(0xabcd, 0, 9)));
  EXPECT_EQ(test::read_poses(page.connection.binary.at(0)).step, 9u);
}

TEST_F(PageProtocolTest, AStatusComesEachSecondWhereNothingChanges) {
  Page page(protocol);
  FakeServer server(domain.number(), 1);
  ASSERT_TRUE(wait_until([&] { return page.count("status") > 0; }));
  const std::size_t before = page.count("status");
  EXPECT_TRUE(wait_until([&] { return page.count("status") >= before + 2; }));
  const auto status = page.connection.find("status").back();
  EXPECT_TRUE(wait_until([&] {
    return page.connection.find("status").back().at("is_silent") == true;
  })) << "the server says nothing any more";
}

TEST_F(PageProtocolTest, NothingIsReadOfTheRecordWithoutAPage) {
  FakeServer server(domain.number(), 1);
  {
    const Page page(protocol);
    ASSERT_TRUE(wait_for_record(server));
  }
  EXPECT_TRUE(wait_until([&] { return !server.is_record_read_by(node); }));
}

TEST_F(PageProtocolTest, APageThatComesLaterIsToldTheSame) {
  Page first(protocol);
  FakeServer server(domain.number(), 1);
  ASSERT_TRUE(wait_until([&] { return first.count("status") > 0 && first.count("event") > 0; }));
  const Page second(protocol);
  EXPECT_EQ(second.count("hello"), 1u);
  EXPECT_EQ(second.count("run"), 1u);
  EXPECT_EQ(second.count("status"), 1u);
  EXPECT_EQ(second.count("event"), 1u);
}

TEST_F(PageProtocolTest, AfterAResetTheNextRunIsShown) {
  Page page(protocol);
  FakeServer server(domain.number(), 1);
  ASSERT_TRUE(wait_until([&] { return page.count("run") == 1; }));
  server.publish(RunPhase::PHASE_RESET, "reset by an operator", 7);
  server.begin_run(make_parameters(2));
  ASSERT_TRUE(wait_until([&] { return page.count("run") == 2; }));
  EXPECT_EQ(page.connection.find("run").at(1).at("run").at("run_id"), "0000000000000002");
  page.connection.binary.clear();
  const auto late_steps_of_the_first_run = make_batch(1, 8, 9);
  ASSERT_TRUE(write_until([&] { return page.has_binary(1); }, server, late_steps_of_the_first_run,
                          make_batch(2, 0, 3)));
  for (const std::string& message : page.connection.binary) {
    if (find_kind(message) == 1) {
      EXPECT_EQ(test::read_poses(message).run_id, 2u);
    }
  }
}

TEST_F(PageProtocolTest, RowsAreThoseOfTheSelectedVehicle) {
  Page page(protocol), other(protocol);
  FakeServer server(domain.number(), 1);
  server.begin_run(make_parameters(2, {0, 3}));
  ASSERT_TRUE(wait_until([&] {
    const auto runs = page.connection.find("run");
    return !runs.empty() && runs.back().at("run").at("run_id") == "0000000000000002";
  }));
  page.say(R"({"op":"select","vehicle_id":3})");
  page.say(R"({"op":"select","vehicle_id":4})");
  EXPECT_EQ(page.count("error"), 1u) << "there is no vehicle 4";
  ASSERT_TRUE(write_until([&] { return page.has_binary(2) && other.has_binary(2); }, server,
                          make_batch(2, 0, 9, {0, 3})));
  for (const auto& [of, id] : {std::pair(&page, 3u), std::pair(&other, 0u)})
    for (const std::string& message : of->connection.binary) {
      if (find_kind(message) == 2) {
        EXPECT_EQ(test::read_rows(message).vehicle_id, id);
      } else {
        EXPECT_EQ(test::read_poses(message).vehicles.size(), 2u);
      }
    }
}

struct Senders : Feed::Listener {
  void note(const Sample& sample) override {
    if (sample.topic == TopicId::kRecord) of_record.insert(sample.sender);
  }
  std::set<bus::PeerId> of_record;
};

TEST_F(PageProtocolTest, ABatchOfAnotherParticipantIsNotDrawn) {
  Page page(protocol);
  Senders senders;
  feed.add(senders);
  FakeServer server(domain.number(), 1);
  ASSERT_TRUE(wait_until([&] { return page.count("run") == 1; }));
  bus::Node other(test::kQosFile, domain.number(), "forger");
  bus::Writer<RecordBatch> forger(other);
  constexpr std::uint64_t kForged = 900'000;
  std::uint64_t step = 0;
  ASSERT_TRUE(wait_until([&] {
    forger.write(make_batch(1, kForged, kForged));
    server.write(make_batch(1, step, step));
    ++step;
    return senders.of_record.size() == 2 && page.has_binary(2);
  }));
  for (const std::string& message : page.connection.binary) {
    if (find_kind(message) == 1) {
      EXPECT_LT(test::read_poses(message).step, kForged);
    } else {
      EXPECT_LT(test::read_rows(message).times.back(), kForged * 0.004);
    }
  }
  feed.remove(senders);
}

TEST_F(PageProtocolTest, APageThatIsBehindGetsPosesAndNoRows) {
  Page page(protocol);
  page.connection.queued = 1 << 20;
  FakeServer server(domain.number(), 1);
  ASSERT_TRUE(wait_until([&] { return page.count("run") == 1; }));
  ASSERT_TRUE(write_until([&] { return page.has_binary(1); }, server, make_batch(1, 0, 9)));
  EXPECT_FALSE(page.has_binary(2));
}

TEST_F(PageProtocolTest, AnInvalidScenarioIsReported) {
  Page page(protocol);
  FakeServer server(domain.number(), 1);
  auto parameters = make_parameters(2);
  parameters.scenario_text("name: [");
  server.begin_run(parameters);
  ASSERT_TRUE(wait_until([&] { return page.count("error") > 0; }));
  EXPECT_NE(
      page.connection.find("error").at(0).at("text").get<std::string>().find("scenario of run"),
      std::string::npos);
}

// --- operating -----------------------------------------------------------------------------------

TEST_F(PageProtocolTest, ARequestReachesTheServerAndItsReplyThePage) {
  Page page(protocol);
  FakeServer server(domain.number(), 5);
  server.publish(RunPhase::PHASE_PAUSED);
  ASSERT_TRUE(wait_until([&] { return page.count("status") > 0; }));
  page.say(R"({"op":"control","id":7,"action":"step","steps":3})");
  ASSERT_TRUE(wait_until([&] { return !server.requests.is_empty(); }));
  const auto request = server.requests.take_all().front();
  EXPECT_EQ(request.run_id(), 5u);
  EXPECT_EQ(request.action(), ControlAction::ACTION_STEP);
  EXPECT_EQ(request.steps(), 3u);
  server.reply(request, false, "not while it lands");
  ASSERT_TRUE(wait_until([&] { return page.count("reply") == 1; }));
  const nlohmann::json expected = {{"op", "reply"},
                                   {"id", 7},
                                   {"action", "step"},
                                   {"accepted", false},
                                   {"reason", "not while it lands"},
                                   {"step", 12}};
  EXPECT_EQ(page.connection.find("reply").at(0), expected);
}

TEST_F(PageProtocolTest, AStopGoesOutWhileAStepRequestIsOpen) {
  Page page(protocol);
  FakeServer server(domain.number(), 5);
  server.publish(RunPhase::PHASE_PAUSED);
  page.say(R"({"op":"control","id":1,"action":"step","steps":900000})");
  ASSERT_TRUE(wait_until([&] { return !server.requests.is_empty(); }));
  const auto step = server.requests.take_all().front();
  page.say(R"({"op":"control","id":2,"action":"stop"})");
  ASSERT_TRUE(wait_until([&] { return !server.requests.is_empty(); }));
  server.reply(server.requests.take_all().front(), true);
  ASSERT_TRUE(wait_until([&] { return page.count("reply") == 1; }));
  EXPECT_EQ(page.connection.find("reply").at(0).at("action"), "stop");
  server.reply(step, false, "stopped");
  ASSERT_TRUE(wait_until([&] { return page.count("reply") == 2; }));
  EXPECT_EQ(page.connection.find("reply").at(1).at("id"), 1);
}

TEST_F(PageWithoutServerTest, ARequestIsRefusedInWords) {
  Page page(protocol);
  page.say(R"({"op":"control","id":1,"action":"pause"})");
  ASSERT_TRUE(wait_until([&] { return page.count("reply") == 1; }));
  EXPECT_EQ(page.connection.find("reply").at(0).at("accepted"), false);
  EXPECT_NE(page.connection.find("reply").at(0).at("reason").get<std::string>().find("no server"),
            std::string::npos);
}

TEST_F(PageWithoutServerTest, OnlySoManyRequestsWait) {
  Page page(protocol);
  for (int i = 0; i < 20; ++i) page.say(R"({"op":"control","id":1,"action":"pause"})");
  ASSERT_TRUE(wait_until([&] { return page.count("reply") >= 12; }));
  EXPECT_NE(page.connection.find("reply").at(0).at("reason").get<std::string>().find("8 requests"),
            std::string::npos);
}

TEST_F(PageProtocolTest, APageThatLeftIsNotRepliedTo) {
  FakeServer server(domain.number(), 5);
  server.publish(RunPhase::PHASE_RUNNING);
  auto page = std::make_unique<Page>(protocol);
  page->say(R"({"op":"control","id":1,"action":"pause"})");
  ASSERT_TRUE(wait_until([&] { return !server.requests.is_empty(); }));
  page.reset();
  server.reply(server.requests.take_all().front(), true);
  Page next(protocol);
  next.say(R"({"op":"control","id":2,"action":"pause"})");
  ASSERT_TRUE(wait_until([&] { return !server.requests.is_empty(); })) << "the first is done";
}

TEST_F(PageProtocolTest, WithoutATokenAPageMayOnlyLook) {
  Page page(protocol);
  page.connection.obstacle = "expected a token";
  page.say(R"({"op":"control","id":1,"action":"stop"})");
  EXPECT_EQ(page.connection.find("reply").at(0).at("reason"), "expected a token");
  page.say(R"({"op":"authenticate","token":"a wrong one"})");
  EXPECT_EQ(page.connection.find("hello").back().at("may_operate"), false);
  EXPECT_EQ(page.connection.find("hello").back().at("needs_token"), true);
  page.say(R"({"op":"authenticate","token":"the right token"})");
  EXPECT_EQ(page.connection.find("hello").back().at("may_operate"), true);
}

TEST_F(PageOfAViewerTest, WithKeysOfAViewerNoPageMayOperate) {
  Page page(protocol);
  const auto hello = page.connection.find("hello").at(0);
  EXPECT_EQ(hello.at("may_operate"), false);
  EXPECT_NE(hello.at("why_not").get<std::string>().find("--identity operator"), std::string::npos);
  page.say(R"({"op":"control","id":1,"action":"stop"})");
  EXPECT_EQ(page.connection.find("reply").at(0).at("accepted"), false);
}

// --- bad input -----------------------------------------------------------------------------------

TEST_F(PageProtocolTest, MalformedMessagesAreAnsweredEach) {
  for (const char* text :
       {"",
        "no JSON",
        "[]",
        "3",
        "null",
        "{}",
        R"({"op":7})",
        R"({"op":"fly"})",
        R"({"op":"hello"})",
        R"({"op":"authenticate"})",
        R"({"op":"authenticate","token":5})",
        R"({"op":"select"})",
        R"({"op":"select","vehicle_id":-1})",
        R"({"op":"select","vehicle_id":1.5})",
        R"({"op":"select","vehicle_id":4294967296})",
        R"({"op":"select","vehicle_id":"0"})",
        R"({"op":"select","vehicle_id":1e400})",
        R"({"op":"control","action":"pause"})",
        R"({"op":"control","id":1,"action":"explode"})",
        R"({"op":"control","id":1,"action":3})",
        R"({"op":"control","id":18446744073709551615,"action":"pause"})",
        R"({"op":"control","id":1,"action":"step","steps":-5})",
        R"({"op":"control","id":1,"action":"step","steps":99999999999999999999999})",
        R"({"op":"control","id":1,"action":"step","steps":null})",
        "\xff\xfe{}"}) {
    Page page(protocol);
    page.say(text);
    EXPECT_EQ(page.count("error"), 1u) << text;
    EXPECT_EQ(page.connection.close_code, 0) << text;
  }
  Page page(protocol);
  page.session->receive(MessageKind::kBinary, "abc");
  page.say(std::string(60'000, '['));
  EXPECT_EQ(page.count("error"), 2u);
}

TEST_F(PageProtocolTest, AnObjectHasAtMost16Keys) {
  const auto say = [this](const std::string& keys) {
    Page page(protocol);
    page.say(R"({"op":"select","vehicle_id":0,)" + keys + "}");
    return page.count("error");
  };
  EXPECT_EQ(say(test::make_keys(14)), 0u);
  EXPECT_EQ(say(test::make_keys(15)), 1u);
  EXPECT_EQ(say(R"("a":[{},{"b":{)" + test::make_keys(16) + "}}]"), 0u);
  EXPECT_EQ(say(R"("a":[{},{"b":{)" + test::make_keys(17) + "}}]"), 1u);
  EXPECT_EQ(say(R"("a":{)" + test::make_keys(9) + "}," + test::make_keys(13)), 0u);
}

TEST_F(PageProtocolTest, APageThatGoesOnWithMistakesIsClosed) {
  Page page(protocol);
  for (int i = 0; i < 20; ++i) page.say("no JSON");
  EXPECT_EQ(page.connection.close_code, 1008);
  EXPECT_EQ(page.count("error"), 8u);
}

// --- the feed alone ------------------------------------------------------------------------------

struct Counter : Feed::Listener {
  void note(const Sample& sample) override {
    ++counts[static_cast<std::size_t>(sample.topic)];
    last = sample;
  }
  void note(const RunView*) override {}
  std::array<int, kTopics> counts{};
  Sample last{};
};

TEST_F(PageProtocolTest, StatesAreReadOnlyWhileTheyAreWanted) {
  Counter counter;
  feed.add(counter);
  FakeServer server(domain.number(), 1);
  ASSERT_TRUE(wait_for_record(server));
  EXPECT_FALSE(server.is_state_read_by(node));
  feed.want(TopicId::kState);
  feed.want(TopicId::kState);
  ASSERT_TRUE(wait_until([&] { return server.is_state_read_by(node); }));
  States states;
  states.run_id(1);
  const int& count = counter.counts[static_cast<std::size_t>(TopicId::kState)];
  int written = 0;
  ASSERT_TRUE(wait_until([&] {  // as in write_until
    server.write(states);
    ++written;
    return count > 0;
  }));
  EXPECT_LE(count, written) << "wanted twice, read once";
  States decoded;
  EXPECT_TRUE(bus::decode(*counter.last.cdr, decoded));
  EXPECT_EQ(decoded, states);
  feed.unwant(TopicId::kState);
  EXPECT_TRUE(server.is_state_read_by(node));
  feed.unwant(TopicId::kState);
  EXPECT_TRUE(wait_until([&] { return !server.is_state_read_by(node); }));
  feed.remove(counter);
}

TEST_F(PageProtocolTest, LatchedSamplesAreKeptForLateReaders) {
  FakeServer server(domain.number(), 1);
  ASSERT_TRUE(wait_until([&] { return feed.latched(TopicId::kParameters).size() == 1; }));
  server.begin_run(make_parameters(2));
  ASSERT_TRUE(wait_until([&] { return feed.run() && feed.run()->run.parameters.run_id() == 2; }));
  EXPECT_EQ(feed.latched(TopicId::kParameters).size(), 1u) << "the last of each sender";
}

}  // namespace
}  // namespace sls::view
