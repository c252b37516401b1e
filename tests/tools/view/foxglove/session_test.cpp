// Sessions on a fake connection and a fake flight.
#include "tools/view/foxglove/session.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/support/text.hpp"
#include "tests/tools/view/foxglove/fakes.hpp"

namespace sls::view::foxglove {
namespace {

using namespace std::chrono_literals;
using sls::test::holds;
using test::Json;

constexpr std::uint64_t kRun = 0x1234;
constexpr char kMessageData = 1, kTime = 2, kServiceCallResponse = 3;

States make_states(std::uint64_t step, std::uint64_t run_id = kRun) {
  States states;
  states.run_id(run_id);
  states.step(step);
  states.sim_time_ns(static_cast<std::int64_t>(step) * 4'000'000);
  states.vehicles().emplace_back().vehicle_id(0);
  return states;
}

RecordBatch make_batch(std::uint64_t first_step, std::size_t steps,
                       const std::vector<std::uint32_t>& vehicles = {0}) {
  RecordBatch batch;
  batch.run_id(kRun);
  for (std::size_t i = 0; i < steps; ++i)
    for (const std::uint32_t id : vehicles) {
      RecordEntry& entry = batch.entries().emplace_back();
      entry.vehicle_id(id);
      entry.step(first_step + i);
      entry.kind(AnswerKind::ANSWER_ACCEPTED);
      entry.truth().q_WB({1, 0, 0, 0});
    }
  return batch;
}

class FoxgloveSessionTest : public ::testing::Test {
 protected:
  FoxgloveSession& connect() {
    session = std::make_unique<FoxgloveSession>(hub, connection);
    return *session;
  }
  void send(const std::string& text) { session->receive(MessageKind::kText, text); }
  void send_json(const Json& json) { send(json.dump()); }
  void call(std::uint32_t service, const std::string& data, const std::string& encoding = "json") {
    session->receive(MessageKind::kBinary, test::to_service_call(service, 77, encoding, data));
  }
  /// The id of the channel of `topic`; fails the test if it is not advertised.
  /// The channel of each topic.
  std::map<std::string, std::uint32_t> list_channels() const {
    std::map<std::string, std::uint32_t> channels;
    for (const Json& advertise : connection.find("advertise"))
      for (const Json& channel : advertise.at("channels"))
        channels.emplace(channel.at("topic"), channel.at("id"));
    return channels;
  }
  std::uint32_t find_channel(const std::string& topic) const { return list_channels().at(topic); }
  void subscribe(std::uint32_t id, std::uint32_t channel) {
    send_json(Json{{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel}}}}});
  }
  std::vector<std::string> errors() const { return connection.find_statuses(2); }
  std::uint32_t find_service(const std::string& name) const {
    for (const Json& advertise : connection.find("advertiseServices"))
      for (const Json& service : advertise.at("services"))
        if (service.at("name") == name) return service.at("id");
    return 0;
  }

  const std::unique_ptr<test::FakeFlight> flight = std::make_unique<test::FakeFlight>();
  std::chrono::steady_clock::time_point now{1h};
  std::shared_ptr<Hub> hub = std::make_shared<Hub>(*flight, *flight, [this] { return now; });
  test::FakeConnection connection;
  std::unique_ptr<FoxgloveSession> session;
};

TEST_F(FoxgloveSessionTest, AClientIsGreetedWithServerAndEveryTopic) {
  flight->begin_run(kRun, {0});
  connect();
  const Json info = connection.find("serverInfo").at(0);
  EXPECT_EQ(info.at("capabilities"), Json({"time"}));
  EXPECT_EQ(info.at("sessionId"), "0000000000001234");
  EXPECT_FALSE(info.contains("supportedEncodings"));
  const Json channels = connection.find("advertise").at(0).at("channels");
  std::vector<std::string> names;
  for (const Json& channel : channels)
    if (channel.at("schemaEncoding") == "omgidl")
      names.push_back(channel.at("topic").get<std::string>() + " " +
                      channel.at("schemaName").get<std::string>());
  EXPECT_EQ(names, (std::vector<std::string>{
                       "sls/state sls::States", "sls/command sls::Commands",
                       "sls/record sls::RecordBatch", "sls/participant sls::Participant",
                       "sls/parameters sls::Parameters", "sls/status sls::SimStatus",
                       "sls/control sls::SimControl", "sls/control_reply sls::SimControlReply"}));
  EXPECT_GT(channels.size(), 8U);  // also the mirrors
  EXPECT_TRUE(connection.find("advertiseServices").empty());
}

TEST_F(FoxgloveSessionTest, WithoutAFlightItExplainsHowToStartOne) {
  connect();
  ASSERT_EQ(connection.find_statuses(0).size(), 1U);
  EXPECT_TRUE(holds(connection.find_statuses(0)[0], "./sls run"));
  EXPECT_EQ(connection.find("serverInfo").at(0).at("sessionId"), "no run");
}

TEST_F(FoxgloveSessionTest, ASampleIsPassedOnAsItCameWithItsSimulationTime) {
  flight->begin_run(kRun, {0});
  connect();
  subscribe(900, find_channel("sls/state"));
  const Sample sample = flight->publish(TopicId::kState, make_states(250));
  const auto messages = connection.find(kMessageData);
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_EQ(test::read_number(messages[0], 1, 4), 900U);
  EXPECT_EQ(test::read_number(messages[0], 5, 8), 1'000'000'000U);
  EXPECT_EQ(messages[0].substr(13), std::string(sample.cdr->begin(), sample.cdr->end()));
}

TEST_F(FoxgloveSessionTest, ATopicIsReadOnlyDuringSubscriptions) {
  flight->begin_run(kRun, {0});
  connect();
  EXPECT_EQ(flight->wanted[TopicId::kState], 0);
  subscribe(1, find_channel("sls/state"));
  EXPECT_EQ(flight->wanted[TopicId::kState], 1);
  send(R"({"op":"unsubscribe","subscriptionIds":[1]})");
  EXPECT_EQ(flight->wanted[TopicId::kState], 0);
  subscribe(1, find_channel("sls/command"));
  session.reset();
  for (const auto& [topic, count] : flight->wanted) EXPECT_EQ(count, 0);
  EXPECT_TRUE(flight->listeners.empty());
}

TEST_F(FoxgloveSessionTest, ALatchedTopicIsSentOnSubscription) {
  flight->begin_run(kRun, {0});
  SimStatus status;
  status.run_id(kRun);
  status.step(500);
  flight->kept[TopicId::kStatus] = {flight->make_sample(TopicId::kStatus, status)};
  connect();
  subscribe(3, find_channel("sls/status"));
  ASSERT_EQ(connection.find(kMessageData).size(), 1U);
  EXPECT_EQ(test::read_number(connection.find(kMessageData)[0], 5, 8), 2'000'000'000U);
  subscribe(4, find_channel("/tf_static"));
  EXPECT_EQ(connection.find(kMessageData).size(), 2U);
}

TEST_F(FoxgloveSessionTest, TimeIsSentAtMost60TimesASecondAndOnSubscription) {
  flight->begin_run(kRun, {0});
  connect();
  const std::uint32_t state = find_channel("sls/state");
  for (std::uint64_t step = 0; step < 1000; ++step, now += 1ms)
    flight->publish(TopicId::kState, make_states(step));
  EXPECT_LE(connection.find(kTime).size(), 60U);
  EXPECT_GE(connection.find(kTime).size(), 55U);
  connection.sent.clear();
  subscribe(1, state);
  ASSERT_EQ(connection.find(kTime).size(), 1U);
  EXPECT_EQ(test::read_number(connection.find(kTime)[0], 1, 8), 999U * 4'000'000);
}

TEST_F(FoxgloveSessionTest, SamplesOfOtherServersDoNotMoveTheTime) {
  flight->begin_run(kRun, {0});
  connect();
  subscribe(1, find_channel("sls/state"));
  flight->publish(TopicId::kState, make_states(1'000'000, kRun + 1));
  flight->server.bytes[0] = 99;  // another participant that claims the run
  flight->publish(TopicId::kState, make_states(2'000'000));
  EXPECT_TRUE(connection.find(kTime).empty());
  EXPECT_EQ(connection.find(kMessageData).size(), 2U);
}

TEST_F(FoxgloveSessionTest, MirrorsComeAtMost100TimesASecondForEachVehicle) {
  flight->begin_run(kRun, {0, 7});
  connect();
  subscribe(1, find_channel("/clock"));
  for (std::uint64_t step = 0; step < 10'000; step += 10, now += 1ms)
    flight->publish(TopicId::kRecord, make_batch(step, 10, {0, 7}));  // for 1 s
  const auto messages = connection.find(kMessageData);
  EXPECT_LE(messages.size(), 104U);
  EXPECT_GE(messages.size(), 95U);
  std::uint64_t last = 0;
  for (const std::string& message : messages) {
    EXPECT_GE(test::read_number(message, 5, 8), last);
    last = test::read_number(message, 5, 8);
  }
}

TEST_F(FoxgloveSessionTest, EveryVehicleOfAFleetOf100IsMirrored) {
  std::vector<std::uint32_t> ids(100);
  std::iota(ids.begin(), ids.end(), 0u);
  flight->begin_run(kRun, ids);
  connect();
  const auto channels = list_channels();
  for (const std::uint32_t id : ids)
    subscribe(id, channels.at("/sls/vehicle_" + std::to_string(id) + "/load/pose"));
  for (std::uint64_t step = 0; step < 100; ++step, now += 10ms)
    for (auto first = ids.begin(); first != ids.end(); first += 20)  // a step has several batches
      flight->publish(TopicId::kRecord, make_batch(step, 1, {first, first + 20}));
  std::map<std::uint64_t, int> counts;
  for (const std::string& message : connection.find(kMessageData))
    ++counts[test::read_number(message, 1, 4)];
  for (const std::uint32_t id : ids) EXPECT_GE(counts[id], 95) << id;
}

TEST_F(FoxgloveSessionTest, ANewRunIsANewSessionAndVanishedVehiclesAreUnadvertised) {
  flight->begin_run(kRun, {0, 1});
  connect();
  const auto before = list_channels();
  std::uint32_t id = 0;
  for (const auto& [topic, channel] : before) subscribe(id++, channel);
  EXPECT_EQ(errors(), std::vector<std::string>());
  flight->publish(TopicId::kState, make_states(1000));
  connection.sent.clear();
  flight->begin_run(kRun + 1, {0, 2});
  EXPECT_EQ(connection.find("serverInfo").at(0).at("sessionId"), "0000000000001235");
  std::set<std::string> gone, come;
  const Json unadvertise = connection.find("unadvertise").at(0);
  const Json advertise = connection.find("advertise").at(0);
  for (const Json& gone_id : unadvertise.at("channelIds"))
    for (const auto& [topic, channel] : before)
      if (gone_id == channel) gone.insert(topic);
  for (const Json& channel : advertise.at("channels")) {
    come.insert(channel.at("topic"));
    for (const auto& [topic, old] : before) EXPECT_NE(channel.at("id"), old);
  }
  ASSERT_FALSE(gone.empty());
  EXPECT_EQ(gone.size(), come.size());
  for (const std::string& topic : gone) {
    EXPECT_TRUE(holds(topic, "vehicle_1")) << topic;
    EXPECT_EQ(come.count(sls::test::replace_once(topic, "vehicle_1", "vehicle_2")), 1U) << topic;
  }
  // Other subscriptions stay, and time starts again. The first message is the static transform.
  now += 1s;
  flight->publish(TopicId::kState, make_states(1, kRun + 1));
  EXPECT_EQ(connection.find(kMessageData).size(), 2U);
  EXPECT_EQ(test::read_number(connection.find(kTime).back(), 1, 8), 4'000'000U);
  // The client may end subscriptions that have ended already: that is no error of the client.
  Json ids = Json::array();
  for (std::uint32_t i = 0; i < id; ++i) ids.push_back(i);
  send_json(Json{{"op", "unsubscribe"}, {"subscriptionIds", ids}});
  EXPECT_EQ(errors(), std::vector<std::string>());
  EXPECT_EQ(flight->wanted[TopicId::kState], 0);
}

TEST_F(FoxgloveSessionTest, EventsAndSilenceAreReportedInWords) {
  flight->begin_run(kRun, {0});
  connect();
  hub->note_event({kRun, 250, "controller pilot took over"});
  EXPECT_EQ(connection.find_statuses(0).back(), "1.000 s: controller pilot took over");
  flight->run->is_silent = true;
  flight->run->silence_s = 2.3;
  flight->tell_run();
  flight->tell_run();
  EXPECT_EQ(connection.find_statuses(1),
            std::vector<std::string>{"The server has been silent for 2.3 s."});
  flight->run->is_silent = false;
  flight->tell_run();
  EXPECT_EQ(connection.find_statuses(0).back(), "The server is heard again.");
  test::FakeConnection late;
  FoxgloveSession other(hub, late);
  EXPECT_EQ(late.find_statuses(0).front(), "1.000 s: controller pilot took over");
}

TEST_F(FoxgloveSessionTest, DroppedMessagesAreReportedOnceASecond) {
  flight->begin_run(kRun, {0});
  connect();
  for (int i = 0; i < 100; ++i, now += 25ms) {
    connection.dropped_messages += 2;
    flight->publish(TopicId::kState, make_states(0));
  }
  const auto warnings = connection.find_statuses(1);
  EXPECT_EQ(warnings, (std::vector<std::string>{"2 messages dropped: the client is slow",
                                                "80 messages dropped: the client is slow",
                                                "80 messages dropped: the client is slow"}));
}

TEST_F(FoxgloveSessionTest, SamplesOfHighRateMayBeDroppedAndTextsMayNot) {
  flight->begin_run(kRun, {0});
  connect();
  subscribe(1, find_channel("sls/state"));
  subscribe(2, find_channel("/tf"));
  flight->publish(TopicId::kState, make_states(1));
  flight->publish(TopicId::kRecord, make_batch(0, 1));
  std::size_t data = 0;
  for (const test::Sent& message : connection.sent) {
    const bool is_data = message.kind == MessageKind::kBinary && message.bytes[0] == kMessageData;
    data += is_data;
    if (is_data) {
      EXPECT_EQ(message.delivery, Delivery::kDroppable);
    }
    if (message.kind == MessageKind::kText) {
      EXPECT_EQ(message.delivery, Delivery::kAlways);
    }
  }
  EXPECT_EQ(data, 2U);
}

// --- services ------------------------------------------------------------------------------------

class FoxgloveServicesTest : public FoxgloveSessionTest {
 protected:
  FoxgloveServicesTest() {
    connection.is_operator = true;
    flight->begin_run(kRun, {0});
    connect();
  }
};

TEST_F(FoxgloveServicesTest, AnOperatorIsOfferedThemByJson) {
  const Json info = connection.find("serverInfo").at(0);
  EXPECT_EQ(info.at("capabilities"), Json({"time", "services"}));
  EXPECT_EQ(info.at("supportedEncodings"), Json({"json"}));
  for (const char* name :
       {"/sls/start", "/sls/pause", "/sls/step", "/sls/resume", "/sls/reset", "/sls/stop"})
    EXPECT_NE(find_service(name), 0U) << name;
  const Json step = connection.find("advertiseServices").at(0).at("services").at(2);
  EXPECT_EQ(step.at("request").at("encoding"), "json");
  const Json schema = Json::parse(step.at("request").at("schema").get<std::string>());
  EXPECT_EQ(schema.at("properties").at("steps").at("type"), "integer");
}

TEST_F(FoxgloveServicesTest, ACallAsksTheFlightAndItsReplyComesBack) {
  call(find_service("/sls/step"), R"({"steps": 25})");
  ASSERT_EQ(flight->requests.size(), 1U);
  EXPECT_EQ(flight->requests[0].action, ControlAction::ACTION_STEP);
  EXPECT_EQ(flight->requests[0].steps, 25U);
  OperatorReply reply;
  reply.is_accepted = true;
  reply.step = 1025;
  flight->requests[0].done(reply);
  const auto responses = connection.find(kServiceCallResponse);
  ASSERT_EQ(responses.size(), 1U);
  EXPECT_EQ(test::read_number(responses[0], 1, 4), find_service("/sls/step"));
  EXPECT_EQ(test::read_number(responses[0], 5, 4), 77U);
  EXPECT_EQ(test::read_number(responses[0], 9, 4), 4U);
  EXPECT_EQ(responses[0].substr(13, 4), "json");
  EXPECT_EQ(Json::parse(responses[0].substr(17)),
            (Json{{"accepted", true}, {"reason", ""}, {"step", 1025}}));
}

TEST_F(FoxgloveServicesTest, ARefusalIsAFailureInWords) {
  call(find_service("/sls/pause"), "{}");
  OperatorReply reply;
  reply.reason = "paused already";
  flight->requests.at(0).done(reply);
  EXPECT_EQ(connection.find("serviceCallFailure").at(0).at("message"),
            "/sls/pause refused: paused already");
  EXPECT_EQ(connection.find("serviceCallFailure").at(0).at("callId"), 77);
  EXPECT_EQ(connection.find_statuses(1).back(), "/sls/pause refused: paused already");
}

TEST_F(FoxgloveServicesTest, AReplyAfterTheClientHasLeftGoesNowhere) {
  call(find_service("/sls/pause"), "");
  session.reset();
  flight->requests.at(0).done({});
}

TEST_F(FoxgloveServicesTest, MalformedCallsAreRefused) {
  const std::uint32_t step = find_service("/sls/step"), pause = find_service("/sls/pause");
  const std::vector<std::pair<std::uint32_t, std::string>> calls = {{step, "{\"steps\": 0}"},
                                                                    {step, "{\"steps\": -1}"},
                                                                    {step, "{\"steps\": 1.5}"},
                                                                    {step, "{\"steps\": \"many\"}"},
                                                                    {step, "[1]"},
                                                                    {step, "{"},
                                                                    {step, "{\"stairs\": 1}"},
                                                                    {pause, "{\"steps\": 1}"},
                                                                    {pause, "\xff\xfe"},
                                                                    {step, "{\"steps\": \"\xff\"}"},
                                                                    {4711, "{}"}};
  for (const auto& [service, data] : calls) {
    const std::size_t before = connection.find("serviceCallFailure").size();
    call(service, data);
    EXPECT_EQ(connection.find("serviceCallFailure").size(), before + 1) << data;
  }
  call(step, "{}", "cdr");
  EXPECT_EQ(connection.find("serviceCallFailure").back().at("message"),
            "/sls/step: encoding: expected json, got 'cdr'");
  EXPECT_TRUE(flight->requests.empty());
}

TEST_F(FoxgloveSessionTest, ARequestWithoutPermissionToOperateIsRefused) {
  flight->begin_run(kRun, {0});
  connect();
  call(2, "{}");
  EXPECT_EQ(connection.find("serviceCallFailure").at(0).at("message"),
            "/sls/pause: not allowed: expected a token");
  connection.is_operator = true;
  flight->may_operate = false;
  call(2, "{}");
  EXPECT_TRUE(holds(connection.find("serviceCallFailure").at(1).at("message"), "keys"));
  EXPECT_TRUE(flight->requests.empty());
}

// --- bad input -----------------------------------------------------------------------------------

struct BadMessage {
  const char* name;
  std::string bytes;
  std::string expected;  // in the answer
  MessageKind kind = MessageKind::kText;
};

class FoxgloveBadMessageTest : public FoxgloveSessionTest,
                               public ::testing::WithParamInterface<BadMessage> {};

TEST_P(FoxgloveBadMessageTest, IsAnsweredInWords) {
  flight->begin_run(kRun, {0});
  connect();
  subscribe(5, find_channel("sls/state"));
  session->receive(GetParam().kind, GetParam().bytes);
  ASSERT_EQ(errors().size(), 1U);
  EXPECT_TRUE(holds(errors()[0], GetParam().expected)) << errors()[0];
  EXPECT_EQ(connection.close_code, 0);
}

INSTANTIATE_TEST_SUITE_P(
    Messages, FoxgloveBadMessageTest,
    ::testing::ValuesIn(std::vector<BadMessage>{
        {"NoJson", "hello", "expected JSON, at most 16 keys an object, got 'hello'"},
        {"Empty", "", "expected JSON"},
        {"Binary", "\xff\x80{}", "got '??{}'"},
        {"Nested", std::string(60'000, '['), "expected JSON"},
        {"Keys",
         R"({"a":0,"b":0,"c":0,"d":0,"e":0,"f":0,"g":0,"h":0,"i":0,"j":0,"k":0,"l":0,"m":0,"n":0,"o":0,"p":0,"q":0})",
         "expected JSON"},
        {"Array", "[]", "expected a JSON object"},
        {"NoOp", "{}", "expected a JSON object with the text op"},
        {"OpNumber", R"({"op":3})", "expected a JSON object with the text op"},
        {"UnknownOp", R"({"op":"dance"})", "got 'dance'"},
        {"ClientPublish", R"({"op":"advertise","channels":[]})", "clientPublish"},
        {"Parameters", R"({"op":"setParameters"})", "capability parameters"},
        {"GetParameters", R"({"op":"getParameters"})", "capability parameters"},
        {"Graph", R"({"op":"subscribeConnectionGraph"})", "connectionGraph"},
        {"Assets", R"({"op":"fetchAsset","uri":"file:///etc/passwd"})", "assets"},
        {"NoSubscriptions", R"({"op":"subscribe"})", "expected an array"},
        {"SubscriptionsText", R"({"op":"subscribe","subscriptions":"all"})", "array"},
        {"SubscriptionText", R"({"op":"subscribe","subscriptions":["a"]})", "objects"},
        {"NegativeId", R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
         "whole numbers"},
        {"FractionalId", R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":1}]})",
         "whole numbers"},
        {"HugeId", R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
         "whole numbers"},
        {"UnknownChannel", R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":999999}]})",
         "there is no channel 999999"},
        {"UsedId", R"({"op":"subscribe","subscriptions":[{"id":5,"channelId":2}]})",
         "subscription 5 is in use"},
        {"UsedChannel", R"({"op":"subscribe","subscriptions":[{"id":6,"channelId":1}]})",
         "channel 1 is subscribed to already"},
        {"NotSubscribed", R"({"op":"unsubscribe","subscriptionIds":[6]})",
         "there is no subscription 6"},
        {"UnsubscribeText", R"({"op":"unsubscribe","subscriptionIds":["5"]})", "whole numbers"},
        {"UnsubscribeNone", R"({"op":"unsubscribe"})", "array"},
        {"NoByte", "", "got no byte", MessageKind::kBinary},
        {"Publish", std::string("\1\0\0\0\0hello", 10), "clientPublish", MessageKind::kBinary},
        {"UnknownOpcode", "\x80", "got 128", MessageKind::kBinary},
        {"ShortCall", std::string("\2\0\0\0", 4), "got 4 bytes", MessageKind::kBinary},
        {"LongEncoding", std::string("\2\0\0\0\0\0\0\0\0\xff\xff\xff\xff", 13), "13 bytes",
         MessageKind::kBinary}}),
    [](const auto& test) { return test.param.name; });

TEST_F(FoxgloveSessionTest, AfterManyErrorsTheConnectionIsClosed) {
  connect();
  for (int i = 0; i < FoxgloveSession::kMostErrors; ++i) send("nonsense");
  EXPECT_EQ(connection.close_code, 0);
  send("nonsense");
  EXPECT_EQ(connection.close_code, 1008);
  const std::size_t sent = connection.sent.size();
  send("nonsense");
  subscribe(1, 1);
  EXPECT_EQ(connection.sent.size(), sent);
}

TEST_F(FoxgloveSessionTest, OneMessageWithManyMistakesEndsToo) {
  connect();
  Json items = Json::array();
  for (int i = 0; i < 1000; ++i) items.push_back({{"id", i}, {"channelId", 777}});
  send_json(Json{{"op", "subscribe"}, {"subscriptions", items}});
  EXPECT_EQ(connection.close_code, 1008);
  EXPECT_EQ(errors().size(), FoxgloveSession::kMostErrors + 1U);
}

}  // namespace
}  // namespace sls::view::foxglove
