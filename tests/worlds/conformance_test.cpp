// The same scripts on the simulated network and on Fast DDS: what worlds rely on is what happens.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "common/bus/node.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/text.hpp"
#include "tests/support/waiting.hpp"
#include "worlds/network.hpp"

namespace sls::test {
extern std::atomic<double> drop_percent;  // drop_shim.cpp, linked into this program
}

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;

using Numbers = std::vector<std::uint64_t>;

/// A writer or a reader of one topic. Samples are numbers.
class Endpoint {
 public:
  virtual ~Endpoint() = default;
  virtual void write(std::uint64_t) {}
  virtual Numbers heard() { return {}; }
  /// Number of counterparts.
  virtual std::size_t matched() = 0;
  virtual bool is_acknowledged() { return true; }
  virtual std::uint64_t missed_deadlines() { return 0; }
  /// The process of a reader that was stopped by kStop goes on.
  virtual void go_on() {}
};

/// A reader that takes this sample stops, with all of its process.
constexpr std::uint64_t kStop = 1'000'000;

/// Endpoints of one participant.
using Endpoints = std::vector<std::unique_ptr<Endpoint>>;

class Middleware {
 public:
  virtual ~Middleware() = default;
  virtual Endpoints add(const std::vector<TopicId>& topics, bool writes) = 0;
  virtual bool wait_until(const std::function<bool()>& is_met) = 0;
  virtual void wait(std::chrono::milliseconds time) = 0;
  /// From now on this share of all datagrams is lost.
  virtual void set_loss(double share) = 0;
};

template <class Message>
Message make(std::uint64_t number) {
  Message message;
  message.run_id(number);
  return message;
}

/// Calls `act` with an empty message of `topic`.
template <class Act>
auto with_message(TopicId topic, Act act) {
  if (topic == TopicId::kState) return act(States());
  if (topic == TopicId::kCommand) return act(Commands());
  if (topic == TopicId::kRecord) return act(RecordBatch());
  return act(SimStatus());
}

// --- Fast DDS ------------------------------------------------------------------------------------

/// config/qos/udp.xml. Within a process Fast DDS would else pass samples without datagrams.
const std::string& find_qos_file() {
  static const test::TemporaryFolder folder;
  static const std::string file = [] {
    const std::string text = test::read_bytes(SLS_SOURCE_DIR "/config/qos/udp.xml");
    test::write_bytes(folder / "udp.xml", test::replace_once(text, "  <profiles>\n", R"(
      <library_settings><intraprocess_delivery>OFF</intraprocess_delivery></library_settings>
      <profiles>)"));
    return (folder / "udp.xml").string();
  }();
  return file;
}

const char* find_reader_profile(TopicId topic) {
  if (topic == TopicId::kState) return bus::kLoopReaderProfile;
  if (topic == TopicId::kCommand) return bus::kRealtimeCommandReaderProfile;
  return topic == TopicId::kRecord ? bus::kRecordReaderProfile : bus::kLatchedReaderProfile;
}

using RealNode = std::shared_ptr<bus::Node>;

template <class Message>
class RealWriter : public Endpoint {
 public:
  RealWriter(RealNode node, TopicId topic)
      : node_(std::move(node)),
        writer_(*node_, topic == TopicId::kCommand
                            ? bus::kRealtimeCommandWriterProfile
                            : bus::find_writer_profile(bus::Topic<Message>::kFlow)) {}
  void write(std::uint64_t number) override { writer_.write(make<Message>(number)); }
  std::size_t matched() override { return writer_.matched().size(); }
  bool is_acknowledged() override { return writer_.wait_for_acknowledgments(0ms); }

 private:
  RealNode node_;
  bus::Writer<Message> writer_;
};

template <class Message>
class RealReader : public Endpoint {
 public:
  RealReader(RealNode node, TopicId topic)
      : node_(std::move(node)),
        reader_(*node_, find_reader_profile(topic),
                [this](const Message& message, const bus::PeerId&) { hear(message.run_id()); }) {}
  Numbers heard() override {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  std::size_t matched() override { return reader_.matched().size(); }
  std::uint64_t missed_deadlines() override { return reader_.missed_deadlines(); }
  void go_on() override {
    const std::lock_guard lock(mutex_);
    goes_on_ = true;
    changed_.notify_all();
  }

 private:
  void hear(std::uint64_t number) {
    std::unique_lock lock(mutex_);
    heard_.push_back(number);
    if (number == kStop) changed_.wait(lock, [this] { return goes_on_; });
  }

  RealNode node_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool goes_on_ = false;
  Numbers heard_;
  bus::Reader<Message> reader_;
};

class RealMiddleware : public Middleware {
 public:
  ~RealMiddleware() override { set_loss(0); }
  Endpoints add(const std::vector<TopicId>& topics, bool writes) override {
    const auto node = std::make_shared<bus::Node>(find_qos_file(), test::own_domain(), "node");
    Endpoints made;
    for (const TopicId topic : topics)
      with_message(topic, [&](auto message) {
        using Message = decltype(message);
        if (writes)
          made.push_back(std::make_unique<RealWriter<Message>>(node, topic));
        else
          made.push_back(std::make_unique<RealReader<Message>>(node, topic));
      });
    return made;
  }
  bool wait_until(const std::function<bool()>& is_met) override { return test::wait_until(is_met); }
  void wait(std::chrono::milliseconds time) override { std::this_thread::sleep_for(time); }
  void set_loss(double share) override { test::drop_percent = 100 * share; }
};

// --- simulated -----------------------------------------------------------------------------------

class SimulatedMiddleware : public Middleware {
 public:
  Endpoints add(const std::vector<TopicId>& topics, bool writes) override {
    const auto node = std::make_shared<Node>(*this);
    Endpoints made;
    for (const TopicId topic : topics)
      with_message(topic, [&](auto message) {
        made.push_back(std::make_unique<Simulated<decltype(message)>>(node, topic, writes));
      });
    network_.announce(node->peer);
    return made;
  }
  bool wait_until(const std::function<bool()>& is_met) override {
    const Instant end = timeline_.now() + 60s;
    while (!is_met())
      if (!timeline_.step(end)) return is_met();
    return true;
  }
  void wait(std::chrono::milliseconds time) override {
    const Instant end = timeline_.now() + time;
    timeline_.at(end, [] {});
    while (timeline_.step(end + Instant(1))) continue;
  }
  void set_loss(double share) override { network_.link(host_, host_) = {1ms, 3ms, share}; }

 private:
  struct Node {
    explicit Node(SimulatedMiddleware& owner)
        : network(owner.network_),
          process(*owner.processes_.emplace_back(
              std::make_unique<Process>(owner.timeline_, owner.host_, "program"))),
          peer(network.join(process)) {}
    ~Node() {
      process.end();
      network.leave(peer, true);
    }
    Network& network;
    Process& process;
    Peer& peer;
  };

  template <class Message>
  class Simulated : public Endpoint {
   public:
    Simulated(std::shared_ptr<Node> node, TopicId topic, bool writes)
        : node_(std::move(node)), topic_(topic), writes_(writes) {
      const auto hear = [this](const Message& message, const Peer::Arrival&) {
        heard_.push_back(message.run_id());
        if (message.run_id() == kStop) node_->process.stop();
      };
      if (writes)
        node_->peer.template add_writer<Message>();
      else
        node_->peer.template add_reader<Message>(
            hear, topic == TopicId::kCommand ? Peer::kRealtimeLimits : ReaderLimits());
    }
    void write(std::uint64_t number) override { node_->peer.write(make<Message>(number)); }
    Numbers heard() override { return heard_; }
    std::size_t matched() override {
      return (writes_ ? node_->peer.matched_readers(topic_) : node_->peer.matched_writers(topic_))
          .size();
    }
    bool is_acknowledged() override { return node_->peer.is_acknowledged(topic_); }
    std::uint64_t missed_deadlines() override { return node_->peer.missed_deadlines(topic_); }
    void go_on() override { node_->process.go_on(); }

   private:
    const std::shared_ptr<Node> node_;
    const TopicId topic_;
    const bool writes_;
    Numbers heard_;
  };

  Timeline timeline_;
  Host host_{timeline_, "host", 100s, 0, 0s};
  Network network_{timeline_, Random(1)};
  std::vector<std::unique_ptr<Process>> processes_;  // they outlive the participants
};

// --- scripts -------------------------------------------------------------------------------------

class ConformanceTest : public testing::TestWithParam<const char*> {
 protected:
  ConformanceTest() {
    if (std::string(GetParam()) == "Simulated")
      middleware_ = std::make_unique<SimulatedMiddleware>();
    else
      middleware_ = std::make_unique<RealMiddleware>();
  }

  auto add_writer(TopicId topic) { return std::move(middleware_->add({topic}, true).front()); }
  auto add_reader(TopicId topic) { return std::move(middleware_->add({topic}, false).front()); }
  bool wait_until(const std::function<bool()>& is_met) { return middleware_->wait_until(is_met); }
  bool are_matched(Endpoint& a, Endpoint& b, std::size_t count = 1) {
    return wait_until([&] { return a.matched() == count && b.matched() == count; });
  }
  bool has_heard(Endpoint& reader, std::uint64_t number) {
    return wait_until([&] {
      const Numbers heard = reader.heard();
      return std::find(heard.begin(), heard.end(), number) != heard.end();
    });
  }
  /// Sends `last - first + 1` samples in as many milliseconds.
  void write(Endpoint& writer, std::uint64_t first, std::uint64_t last) {
    for (std::uint64_t i = first; i <= last; ++i) {
      writer.write(i);
      middleware_->wait(1ms);
    }
  }
  static Numbers count(std::uint64_t first, std::uint64_t last) {
    Numbers numbers(last - first + 1);
    std::iota(numbers.begin(), numbers.end(), first);
    return numbers;
  }

  std::unique_ptr<Middleware> middleware_;
};

TEST_P(ConformanceTest, ReliableSamplesOfAWriterComeInOrder) {
  const auto writer = add_writer(TopicId::kRecord), reader = add_reader(TopicId::kRecord);
  ASSERT_TRUE(are_matched(*writer, *reader));
  for (std::uint64_t i = 1; i <= 500; ++i) writer->write(i);
  ASSERT_TRUE(has_heard(*reader, 500));
  EXPECT_EQ(reader->heard(), count(1, 500));
}

TEST_P(ConformanceTest, ALateReliableReaderGetsTheHistoryAndThenTheRest) {
  const auto writer = add_writer(TopicId::kStatus);
  for (std::uint64_t i = 1; i <= 200; ++i) writer->write(i);
  const auto reader = add_reader(TopicId::kStatus);
  ASSERT_TRUE(has_heard(*reader, 200));
  EXPECT_EQ(reader->heard(), count(51, 200)) << "the writer keeps 150";
  writer->write(201);
  ASSERT_TRUE(has_heard(*reader, 201));
  EXPECT_EQ(reader->heard(), count(51, 201));
}

TEST_P(ConformanceTest, ALateRecorderGetsTheLastBatches) {
  const auto writer = add_writer(TopicId::kRecord);
  for (std::uint64_t i = 1; i <= 5100; ++i) writer->write(i);
  const auto reader = add_reader(TopicId::kRecord);
  ASSERT_TRUE(has_heard(*reader, 5100));
  EXPECT_EQ(reader->heard(), count(101, 5100)) << "the writer keeps 5,000";
}

TEST_P(ConformanceTest, ALateBestEffortReaderGetsOnlyTheRest) {
  const auto writer = add_writer(TopicId::kState);
  writer->write(1);
  const auto reader = add_reader(TopicId::kState);
  ASSERT_TRUE(are_matched(*writer, *reader));
  writer->write(2);
  ASSERT_TRUE(has_heard(*reader, 2));
  EXPECT_EQ(reader->heard(), Numbers{2});
}

TEST_P(ConformanceTest, EachReaderGetsTheHistoryOfEachWriter) {
  const auto one = add_writer(TopicId::kStatus), other = add_writer(TopicId::kStatus);
  for (std::uint64_t i = 1; i <= 10; ++i) {
    one->write(i);
    other->write(100 + i);
  }
  const auto reader = add_reader(TopicId::kStatus), second = add_reader(TopicId::kStatus);
  for (Endpoint* hearer : {reader.get(), second.get()}) {
    ASSERT_TRUE(has_heard(*hearer, 10));
    ASSERT_TRUE(has_heard(*hearer, 110));
    Numbers heard = hearer->heard();
    const auto middle = std::stable_partition(heard.begin(), heard.end(),
                                              [](std::uint64_t number) { return number <= 100; });
    EXPECT_EQ(Numbers(heard.begin(), middle), count(1, 10));
    EXPECT_EQ(Numbers(middle, heard.end()), count(101, 110));
  }
}

TEST_P(ConformanceTest, OneThatLeavesIsUnmatchedAtTheOther) {
  const auto reader = add_reader(TopicId::kStatus);
  auto writer = add_writer(TopicId::kStatus);
  ASSERT_TRUE(are_matched(*writer, *reader));
  writer.reset();
  EXPECT_TRUE(wait_until([&] { return reader->matched() == 0; }));
  writer = add_writer(TopicId::kStatus);
  auto second = add_reader(TopicId::kStatus);
  ASSERT_TRUE(wait_until([&] { return writer->matched() == 2 && second->matched() == 1; }));
  second.reset();
  EXPECT_TRUE(wait_until([&] { return writer->matched() == 1; }));
}

TEST_P(ConformanceTest, AReaderThatComesAgainGetsTheHistoryAgain) {
  const auto writer = add_writer(TopicId::kStatus);
  for (std::uint64_t i = 1; i <= 5; ++i) writer->write(i);
  for (int round = 0; round < 2; ++round) {
    const auto reader = add_reader(TopicId::kStatus);
    ASSERT_TRUE(has_heard(*reader, 5));
    EXPECT_EQ(reader->heard(), count(1, 5));
  }
}

TEST_P(ConformanceTest, TheHistoryOfAWriterThatHasLeftIsGone) {
  auto gone = add_writer(TopicId::kStatus);
  gone->write(1);
  gone.reset();
  const auto writer = add_writer(TopicId::kStatus);
  writer->write(2);
  const auto reader = add_reader(TopicId::kStatus);
  ASSERT_TRUE(has_heard(*reader, 2));
  EXPECT_EQ(reader->heard(), Numbers{2});
}

TEST_P(ConformanceTest, AcknowledgedIsWhatEveryReliableReaderHasGot) {
  const auto writer = add_writer(TopicId::kStatus);
  writer->write(1);
  EXPECT_TRUE(writer->is_acknowledged()) << "there is no reader";
  const auto reader = add_reader(TopicId::kStatus);
  ASSERT_TRUE(are_matched(*writer, *reader));
  for (std::uint64_t i = 2; i <= 50; ++i) writer->write(i);
  ASSERT_TRUE(wait_until([&] { return writer->is_acknowledged(); }));
  EXPECT_EQ(reader->heard(), count(1, 50));
}

TEST_P(ConformanceTest, BestEffortSamplesOfAWriterNeverComeTwiceOrInAnotherOrder) {
  const auto writer = add_writer(TopicId::kState), reader = add_reader(TopicId::kState);
  ASSERT_TRUE(are_matched(*writer, *reader));
  std::uint64_t number = 0;
  ASSERT_TRUE(wait_until([&] {
    writer->write(++number);
    return reader->heard().size() >= 200;
  }));
  const Numbers heard = reader->heard();
  EXPECT_EQ(std::adjacent_find(heard.begin(), heard.end(), std::greater_equal<>()), heard.end());
}

TEST_P(ConformanceTest, AReaderHearsNothingOfAnotherTopic) {
  const auto status = add_writer(TopicId::kStatus), record = add_writer(TopicId::kRecord);
  status->write(1);
  record->write(2);
  const auto reader = add_reader(TopicId::kStatus), other = add_reader(TopicId::kRecord);
  ASSERT_TRUE(has_heard(*reader, 1));
  ASSERT_TRUE(has_heard(*other, 2));
  EXPECT_EQ(reader->heard(), Numbers{1});
  EXPECT_EQ(other->heard(), Numbers{2});
}

// --- loss ----------------------------------------------------------------------------------------

TEST_P(ConformanceTest, ReliableSamplesAllComeInOrderInSpiteOfLosses) {
  const auto writer = add_writer(TopicId::kRecord), reader = add_reader(TopicId::kRecord);
  ASSERT_TRUE(are_matched(*writer, *reader));
  middleware_->set_loss(0.3);
  write(*writer, 1, 300);
  EXPECT_FALSE(writer->is_acknowledged());
  ASSERT_TRUE(has_heard(*reader, 300));
  EXPECT_EQ(reader->heard(), count(1, 300));
  EXPECT_TRUE(wait_until([&] { return writer->is_acknowledged(); }));
}

TEST_P(ConformanceTest, LostBestEffortSamplesAreGoneAndTheOthersComeInOrder) {
  const auto writer = add_writer(TopicId::kState), reader = add_reader(TopicId::kState);
  ASSERT_TRUE(are_matched(*writer, *reader));
  middleware_->set_loss(0.3);
  write(*writer, 1, 500);
  middleware_->set_loss(0);
  std::uint64_t last = 500;
  ASSERT_TRUE(wait_until([&] {
    writer->write(++last);
    return reader->heard().back() > 500;
  }));
  const Numbers heard = reader->heard();
  EXPECT_EQ(std::adjacent_find(heard.begin(), heard.end(), std::greater_equal<>()), heard.end());
  EXPECT_GT(heard.size(), 200u);
  EXPECT_LT(heard.size(), 450u) << "the writer is reliable, but sends none again to this reader";
}

TEST_P(ConformanceTest, AfterACutAReliableReaderGetsWhatTheHistoryStillHolds) {
  const auto writer = add_writer(TopicId::kStatus), reader = add_reader(TopicId::kStatus);
  ASSERT_TRUE(are_matched(*writer, *reader));
  middleware_->set_loss(1);
  write(*writer, 1, 200);
  EXPECT_TRUE(reader->heard().empty());
  middleware_->set_loss(0);
  ASSERT_TRUE(has_heard(*reader, 200));
  EXPECT_EQ(reader->heard(), count(51, 200));
}

TEST_P(ConformanceTest, TheEndpointsOfAParticipantAreDiscoveredInTheirOrder) {
  const std::vector<TopicId> topics = {TopicId::kRecord, TopicId::kStatus};
  for (const double loss : {0.0, 0.0, 0.0, 0.2}) {
    middleware_->set_loss(loss);
    for (const bool first_writes : {true, false}) {
      const Endpoints there = middleware_->add(topics, first_writes);
      const Endpoints here = middleware_->add(topics, !first_writes);
      EXPECT_TRUE(wait_until([&] {
        const bool knows_last = here[1]->matched() > 0;
        EXPECT_TRUE(!knows_last || here[0]->matched() > 0);
        return knows_last;
      }));
    }
  }
}

// --- deadline and lifespan of commands in real time: 0.1 and 0.2 s -------------------------------

TEST_P(ConformanceTest, EachDeadlineWithoutASampleIsCounted) {
  const auto writer = add_writer(TopicId::kCommand), reader = add_reader(TopicId::kCommand);
  ASSERT_TRUE(are_matched(*writer, *reader));
  middleware_->wait(250ms);
  EXPECT_EQ(reader->missed_deadlines(), 0u) << "the first one begins with a sample";
  writer->write(1);
  ASSERT_TRUE(has_heard(*reader, 1));
  middleware_->wait(350ms);
  EXPECT_GE(reader->missed_deadlines(), 2u);
}

TEST_P(ConformanceTest, ASampleThatIsTooOldWhenItArrivesIsDropped) {
  const auto writer = add_writer(TopicId::kCommand), reader = add_reader(TopicId::kCommand);
  ASSERT_TRUE(are_matched(*writer, *reader));
  writer->write(kStop);
  ASSERT_TRUE(has_heard(*reader, kStop));
  writer->write(1);
  middleware_->wait(300ms);
  writer->write(2);
  reader->go_on();
  ASSERT_TRUE(has_heard(*reader, 2));
  EXPECT_EQ(reader->heard(), (Numbers{kStop, 2}));
}

INSTANTIATE_TEST_SUITE_P(Both, ConformanceTest, testing::Values("Simulated", "FastDds"),
                         [](const auto& name) { return std::string(name.param); });

}  // namespace
}  // namespace sls::worlds
