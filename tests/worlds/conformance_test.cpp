// The same scripts on the simulated network and on Fast DDS: what worlds rely on is what happens.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <vector>

#include "common/bus/node.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/waiting.hpp"
#include "worlds/network.hpp"

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;

using Numbers = std::vector<std::uint64_t>;

/// A participant with a writer or a reader of one topic. Samples are numbers.
class Participant {
 public:
  virtual ~Participant() = default;
  virtual void write(std::uint64_t number) = 0;
  virtual Numbers heard() = 0;
  /// Number of counterparts.
  virtual std::size_t matched() = 0;
  virtual bool is_acknowledged() = 0;
};

class Middleware {
 public:
  virtual ~Middleware() = default;
  virtual std::unique_ptr<Participant> add_writer(TopicId topic) = 0;
  virtual std::unique_ptr<Participant> add_reader(TopicId topic) = 0;
  virtual bool wait_until(const std::function<bool()>& is_met) = 0;
};

template <class Message>
Message make(std::uint64_t number) {
  Message message;
  message.run_id(number);
  return message;
}

// --- Fast DDS ------------------------------------------------------------------------------------

template <class Message>
class RealWriter : public Participant {
 public:
  RealWriter()
      : node_(SLS_SOURCE_DIR "/config/qos/udp.xml", test::own_domain(), "writer"), writer_(node_) {}
  void write(std::uint64_t number) override { writer_.write(make<Message>(number)); }
  Numbers heard() override { return {}; }
  std::size_t matched() override { return writer_.matched().size(); }
  bool is_acknowledged() override { return writer_.wait_for_acknowledgments(0ms); }

 private:
  bus::Node node_;
  bus::Writer<Message> writer_;
};

template <class Message>
class RealReader : public Participant {
 public:
  explicit RealReader(const char* profile)
      : node_(SLS_SOURCE_DIR "/config/qos/udp.xml", test::own_domain(), "reader"),
        reader_(node_, profile, [this](const Message& message, const bus::PeerId&) {
          const std::lock_guard lock(mutex_);
          heard_.push_back(message.run_id());
        }) {}
  void write(std::uint64_t) override {}
  Numbers heard() override {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  std::size_t matched() override { return reader_.matched().size(); }
  bool is_acknowledged() override { return true; }

 private:
  bus::Node node_;
  std::mutex mutex_;
  Numbers heard_;
  bus::Reader<Message> reader_;
};

class RealMiddleware : public Middleware {
 public:
  std::unique_ptr<Participant> add_writer(TopicId topic) override {
    if (topic == TopicId::kState) return std::make_unique<RealWriter<States>>();
    if (topic == TopicId::kRecord) return std::make_unique<RealWriter<RecordBatch>>();
    return std::make_unique<RealWriter<SimStatus>>();
  }
  std::unique_ptr<Participant> add_reader(TopicId topic) override {
    if (topic == TopicId::kState)
      return std::make_unique<RealReader<States>>(bus::kLoopReaderProfile);
    if (topic == TopicId::kRecord)
      return std::make_unique<RealReader<RecordBatch>>(bus::kRecordReaderProfile);
    return std::make_unique<RealReader<SimStatus>>(bus::kLatchedReaderProfile);
  }
  bool wait_until(const std::function<bool()>& is_met) override { return test::wait_until(is_met); }
};

// --- simulated -----------------------------------------------------------------------------------

class SimulatedMiddleware : public Middleware {
 public:
  std::unique_ptr<Participant> add_writer(TopicId topic) override {
    if (topic == TopicId::kState) return add<States>(topic, true);
    if (topic == TopicId::kRecord) return add<RecordBatch>(topic, true);
    return add<SimStatus>(topic, true);
  }
  std::unique_ptr<Participant> add_reader(TopicId topic) override {
    if (topic == TopicId::kState) return add<States>(topic, false);
    if (topic == TopicId::kRecord) return add<RecordBatch>(topic, false);
    return add<SimStatus>(topic, false);
  }
  bool wait_until(const std::function<bool()>& is_met) override {
    const Instant end = timeline_.now() + 60s;
    while (!is_met())
      if (!timeline_.step(end)) return is_met();
    return true;
  }

 private:
  template <class Message>
  class Simulated : public Participant {
   public:
    Simulated(SimulatedMiddleware& owner, TopicId topic, bool writes)
        : owner_(owner),
          topic_(topic),
          writes_(writes),
          process_(*owner.processes_.emplace_back(
              std::make_unique<Process>(owner.timeline_, owner.host_, "program"))),
          peer_(owner.network_.join(process_)) {
      if (writes)
        peer_.add_writer<Message>();
      else
        peer_.add_reader<Message>([this](const Message& message, const Peer::Arrival&) {
          heard_.push_back(message.run_id());
        });
      owner.network_.announce(peer_);
    }
    ~Simulated() override {
      process_.end();
      owner_.network_.leave(peer_, true);
    }
    void write(std::uint64_t number) override { peer_.write(make<Message>(number)); }
    Numbers heard() override { return heard_; }
    std::size_t matched() override {
      return (writes_ ? peer_.matched_readers(topic_) : peer_.matched_writers(topic_)).size();
    }
    bool is_acknowledged() override { return peer_.is_acknowledged(topic_); }

   private:
    SimulatedMiddleware& owner_;
    const TopicId topic_;
    const bool writes_;
    Process& process_;
    Peer& peer_;
    Numbers heard_;
  };

  template <class Message>
  std::unique_ptr<Participant> add(TopicId topic, bool writes) {
    return std::make_unique<Simulated<Message>>(*this, topic, writes);
  }

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

  auto add_writer(TopicId topic) { return middleware_->add_writer(topic); }
  auto add_reader(TopicId topic) { return middleware_->add_reader(topic); }
  bool wait_until(const std::function<bool()>& is_met) { return middleware_->wait_until(is_met); }
  bool are_matched(Participant& a, Participant& b, std::size_t count = 1) {
    return wait_until([&] { return a.matched() == count && b.matched() == count; });
  }
  bool has_heard(Participant& reader, std::uint64_t number) {
    return wait_until([&] {
      const Numbers heard = reader.heard();
      return std::find(heard.begin(), heard.end(), number) != heard.end();
    });
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
  for (Participant* hearer : {reader.get(), second.get()}) {
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

INSTANTIATE_TEST_SUITE_P(Both, ConformanceTest, testing::Values("Simulated", "FastDds"),
                         [](const auto& name) { return std::string(name.param); });

}  // namespace
}  // namespace sls::worlds
