// README.md, trap 40. A transport of Fast DDS's own tests loses fragments.
#include <gtest/gtest.h>
#include <slsPubSubTypes.h>
#include <fastdds/LibrarySettings.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/rtps/transport/test_UDPv4TransportDescriptor.hpp>

#include <atomic>
#include <memory>

#include "common/bus/node.hpp"
#include "common/bus/topics.hpp"
#include "fastdds_types.hpp"
#include "tests/common/bus/sample_messages.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/waiting.hpp"

namespace sls::bus {
namespace {

using sls::test::own_domain;
using sls::test::wait_until;
using test::make_message;

constexpr std::uint32_t kDatagram = 700;
constexpr int kRounds = 20;

/// A writer of sls/state that loses every second fragment.
class LossyWriter {
 public:
  LossyWriter() {
    auto transport = std::make_shared<rtps::test_UDPv4TransportDescriptor>();
    transport->maxMessageSize = kDatagram;
    transport->dropDataFragMessagesPercentage = 50;
    dds::DomainParticipantQos qos;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    participant_ = factory().create_participant(own_domain(), qos);
    dds::TypeSupport type(new StatesPubSubType);
    leave_out_type_object(type);
    type.register_type(participant_);
    topic_ = participant_->create_topic(Topic<States>::kName, type.get_type_name(),
                                        dds::TOPIC_QOS_DEFAULT);
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    dds::DataWriterQos writer_qos;
    writer_qos.reliability().kind = dds::BEST_EFFORT_RELIABILITY_QOS;
    writer_qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
    writer_qos.history().depth = 2 * kRounds;
    writer_ = publisher_->create_datawriter(topic_, writer_qos);
  }
  ~LossyWriter() {
    participant_->delete_contained_entities();
    factory().delete_participant(participant_);
  }

  bool is_matched() const {
    dds::PublicationMatchedStatus status;
    return writer_ && is_ok(writer_->get_publication_matched_status(status)) &&
           status.current_count > 0;
  }
  bool write(const States& sample) { return write_sample(*writer_, &sample); }

 private:
  static dds::DomainParticipantFactory& factory() {
    return *dds::DomainParticipantFactory::get_instance();
  }
  dds::DomainParticipant* participant_;
  dds::Topic* topic_;
  dds::Publisher* publisher_;
  dds::DataWriter* writer_;
};

TEST(LostFragmentsTest, AReaderSurvivesALaterSampleThatArrivedWhole) {
  eprosima::fastdds::LibrarySettings settings;
  settings.intraprocess_delivery = eprosima::fastdds::INTRAPROCESS_OFF;
  ASSERT_TRUE(is_ok(dds::DomainParticipantFactory::get_instance()->set_library_settings(settings)));
  Node node(SLS_SOURCE_DIR "/config/qos/udp.xml", own_domain(), "reading");
  std::atomic<int> large_ones = 0;
  std::atomic<std::uint64_t> last = 0;
  Reader<States> reader(node, kLoopReaderProfile, [&](const States& sample, const PeerId&) {
    if (!sample.vehicles().empty()) ++large_ones;
    last = sample.step();
  });
  LossyWriter writer;
  ASSERT_TRUE(wait_until([&] { return writer.is_matched() && !reader.matched().empty(); }));

  States large = make_message<States>(1), small;
  for (int round = 1; round <= kRounds; ++round) {
    ASSERT_TRUE(writer.write(large));
    small.step(static_cast<std::uint64_t>(round));
    ASSERT_TRUE(wait_until([&] {  // one sent in a datagram with a fragment is lost with it
      return last == small.step() || !writer.write(small);
    }));
  }
  EXPECT_EQ(last, static_cast<std::uint64_t>(kRounds));
  EXPECT_EQ(large_ones, 0);  // otherwise not every one has lost a fragment
}

}  // namespace
}  // namespace sls::bus
