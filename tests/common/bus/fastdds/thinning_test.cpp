// Readers with a share of the samples: which samples belong to it, and that the writer leaves out
// the others.
#include "common/bus/fastdds/thinning.hpp"

#include <gtest/gtest.h>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/IContentFilter.hpp>
#include <fastdds/dds/topic/IContentFilterFactory.hpp>

#include <filesystem>
#include <mutex>
#include <string_view>
#include <utility>
#include <vector>

#include "common/bus/topics.hpp"
#include "fastdds_api.hpp"
#include "tests/common/bus/sample_messages.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/waiting.hpp"

namespace sls::bus {
namespace {

using namespace std::chrono_literals;
using sls::test::own_domain;
using sls::test::wait_until;

const std::filesystem::path kQosFile = SLS_SOURCE_DIR "/config/qos/default.xml";
constexpr Share kThreeOfTenSeconds = {3, 10s};

TEST(ThinningTest, OfEachWindowTheFirstSamplesPass) {
  Thinning thinning({2, 50ms});
  const auto start = Thinning::Time() + 1h;
  std::vector<bool> passed;
  // The second window begins with the sample after a pause, not on a grid.
  for (const auto at : {0ms, 1ms, 2ms, 49ms, 180ms, 181ms, 182ms, 229ms, 230ms})
    passed.push_back(thinning.passes(start + at));
  EXPECT_EQ(passed, (std::vector<bool>{1, 1, 0, 0, 1, 1, 0, 0, 1}));
}

TEST(ThinningTest, AShareIsReadAsItWasWritten) {
  const auto read = read_share(kThinningExpression, to_parameters({16, 50ms}));
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, (Share{16, 50ms}));
  EXPECT_TRUE(read_share(kThinningExpression, {"1000", "10000"}));
}

TEST(ThinningTest, OtherTextsFromTheNetworkAreRefused) {
  using Texts = std::vector<std::string>;
  EXPECT_FALSE(read_share("", {"4", "50"}));
  EXPECT_FALSE(read_share("at most %0 samples", {"4", "50"}));
  for (const Texts& parameters : {Texts{},
                                  {"4"},
                                  {"4", "50", "1"},
                                  {"", "50"},
                                  {"4", ""},
                                  {"0", "50"},
                                  {"4", "0"},
                                  {"1001", "50"},
                                  {"4", "10001"},
                                  {"-4", "50"},
                                  {"4.5", "50"},
                                  {"4", "50 "},
                                  {"4", "5e1"},
                                  {"4", "99999999999999999999"}})
    EXPECT_FALSE(read_share(kThinningExpression, parameters))
        << ::testing::PrintToString(parameters);
}

RecordBatch make_batch(std::uint64_t index) {
  RecordBatch batch;
  batch.batch_index(index);
  return batch;
}

/// Keeps the numbers of the batches that a reader gets.
class Arrived {
 public:
  explicit Arrived(Node& node, const Share& share = {})
      : reader_(
            node, kLoopReaderProfile,
            [this](std::vector<std::uint8_t>& cdr, const PeerId&) {
              const std::lock_guard lock(mutex_);
              samples_.push_back(std::move(cdr));
            },
            share) {}

  void change_share(const Share& share) { reader_.change_share(share); }

  /// Both sides know each other: before, samples are lost.
  bool is_matched(const Writer<RecordBatch>& writer, const Node& reading,
                  const Node& writing) const {
    return writer.matched().count(reading.id()) > 0 && reader_.matched().count(writing.id()) > 0;
  }

  std::vector<std::uint64_t> numbers() const {
    const std::lock_guard lock(mutex_);
    std::vector<std::uint64_t> found;
    for (const auto& sample : samples_) {
      RecordBatch batch;
      EXPECT_TRUE(decode(sample, batch));
      found.push_back(batch.batch_index());
    }
    return found;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::vector<std::uint8_t>> samples_;
  RawReader<RecordBatch> reader_;
};

/// Lets Fast DDS send samples within a process, too. It would else call readers directly, which
/// then filter themselves.
void send_within_process() {
  constexpr std::string_view kSettings = R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <library_settings><intraprocess_delivery>OFF</intraprocess_delivery></library_settings>
</dds>)";
  auto* factory = dds::DomainParticipantFactory::get_instance();
  ASSERT_TRUE(is_ok(factory->load_XML_profiles_string(kSettings.data(), kSettings.size())));
}

TEST(ThinningTest, EachReaderGetsItsOwnShareBesideOneThatGetsAll) {
  send_within_process();
  Node writing(kQosFile, own_domain(), "writing");
  Node first_node(kQosFile, own_domain(), "first", "", Transports::kNetwork);
  Node second_node(kQosFile, own_domain(), "second", "", Transports::kNetwork);
  Node whole_node(kQosFile, own_domain(), "whole", "", Transports::kNetwork);
  Arrived first(first_node, kThreeOfTenSeconds), whole(whole_node);
  Writer<RecordBatch> writer(writing);
  ASSERT_TRUE(wait_until([&] {
    return first.is_matched(writer, first_node, writing) &&
           whole.is_matched(writer, whole_node, writing);
  }));
  std::uint64_t number = 0;
  const auto write_all = [&] {
    for (int i = 0; i < 20; ++i) writer.write(make_batch(++number));
    return wait_until([&] { return whole.numbers().size() == number; });
  };
  ASSERT_TRUE(write_all());
  Arrived second(second_node, kThreeOfTenSeconds);  // its window begins later
  ASSERT_TRUE(wait_until([&] { return second.is_matched(writer, second_node, writing); }));
  ASSERT_TRUE(write_all());
  using Numbers = std::vector<std::uint64_t>;
  EXPECT_TRUE(wait_until([&] { return second.numbers() == Numbers{21, 22, 23}; }));
  EXPECT_EQ(first.numbers(), (Numbers{1, 2, 3}));

  // The other share comes by discovery, later than samples.
  first.change_share(kWholeShare);
  EXPECT_TRUE(wait_until([&] {
    const std::size_t before = first.numbers().size();
    return write_all() && first.numbers().size() >= before + 20;
  }));
  EXPECT_EQ(second.numbers().size(), 3u);
}

/// A filter of the same class that passes everything, whatever the share is.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"
struct OpenFactory final : dds::IContentFilterFactory {
  struct Filter final : dds::IContentFilter {
    bool evaluate(const SerializedPayload&, const FilterSampleInfo&, const GUID_t&) const override {
      return true;
    }
  };
  ReturnCode create_content_filter(const char*, const char*, const dds::TopicDataType*, const char*,
                                   const ParameterSeq&, dds::IContentFilter*& filter) override {
    filter = &open;
    return kOk;
  }
  ReturnCode delete_content_filter(const char*, dds::IContentFilter*) override { return kOk; }
  Filter open;
};
#pragma GCC diagnostic pop

TEST(ThinningTest, TheWriterLeavesOutWhatExceedsTheShare) {
  // The reader's own filter would let everything pass.
  static OpenFactory factory;
  send_within_process();
  Node writing(kQosFile, own_domain(), "writing");
  Node whole_node(kQosFile, own_domain(), "whole", "", Transports::kNetwork);
  Arrived whole(whole_node);
  Writer<RecordBatch> writer(writing);

  auto* participants = dds::DomainParticipantFactory::get_instance();
  auto* participant = participants->create_participant_with_profile(
      static_cast<std::uint32_t>(own_domain()), kParticipantProfile);
  ASSERT_TRUE(participant);
  ASSERT_TRUE(is_ok(participant->register_content_filter_factory(kThinningClass, &factory)));
  dds::TypeSupport type(static_cast<dds::TopicDataType*>(detail::make_type_support<RecordBatch>()));
  leave_out_type_object(type);
  ASSERT_TRUE(is_ok(type.register_type(participant)));
  auto* topic = participant->create_topic(Topic<RecordBatch>::kName, type.get_type_name(),
                                          dds::TOPIC_QOS_DEFAULT);
  ASSERT_TRUE(topic);
  auto* share = make_share_of(*topic, kThreeOfTenSeconds);
  ASSERT_TRUE(share);
  auto* subscriber = participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  dds::DataReaderQos qos;
  subscriber->get_datareader_qos_from_profile(kLoopReaderProfile, qos);
  qos.data_sharing().off();
  auto* reader = subscriber->create_datareader(share, qos);
  ASSERT_TRUE(reader);

  ASSERT_TRUE(wait_until([&] {
    dds::SubscriptionMatchedStatus status;
    return writer.matched().size() == 2 && whole.is_matched(writer, whole_node, writing) &&
           is_ok(reader->get_subscription_matched_status(status)) && status.current_count == 1;
  }));
  for (std::uint64_t index = 1; index <= 20; ++index) writer.write(make_batch(index));
  ASSERT_TRUE(wait_until([&] { return whole.numbers().size() == 20; }));
  int count = 0;
  const auto take_all = [&] {
    RecordBatch batch;
    dds::SampleInfo info;
    while (is_ok(reader->take_next_sample(&batch, &info))) ++count;
    return count >= 3;
  };
  EXPECT_TRUE(wait_until(take_all));
  take_all();
  EXPECT_EQ(count, 3);
  participant->delete_contained_entities();
  participants->delete_participant(participant);
}

}  // namespace
}  // namespace sls::bus
