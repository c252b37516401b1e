#include "tools/doctor/endpoint_qos.hpp"

#include <slsPubSubTypes.h>

#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/publisher/qos/PublisherQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/subscriber/qos/SubscriberQos.hpp>

#include "common/bus/fastdds/facts_of.hpp"
#include "common/bus/topics.hpp"
#include "fastdds_types.hpp"

namespace sls::doctor {
namespace {

namespace dds = eprosima::fastdds::dds;

/// `group`: the QoS of the endpoint's publisher or subscriber.
template <class Qos, class GroupQos>
void fill(Endpoint& endpoint, const Qos& qos, const GroupQos& group) {
  bus::detail::fill(endpoint, qos.reliability(), qos.durability(), qos.deadline(), qos.liveliness(),
                    qos.ownership());
  endpoint.partitions = group.partition().names();
}

/// Makes the endpoints of one topic after another.
class Maker {
 public:
  Maker(dds::Publisher& publisher, dds::Subscriber& subscriber, const std::string& file)
      : publisher_(publisher), subscriber_(subscriber), file_(file) {}

  template <class Message, class PubSubType>
  void add() {
    PubSubType type;
    Endpoint endpoint;
    endpoint.topic = bus::Topic<Message>::kName;
    endpoint.type = bus::name_of(type);
    endpoint.max_size = bus::max_size_of(type);
    const bus::Flow flow = bus::Topic<Message>::kFlow;
    add_writer(endpoint, bus::find_writer_profile(flow));
    add_reader(endpoint, flow == bus::Flow::kLoop     ? bus::kLoopReaderProfile
                         : flow == bus::Flow::kRecord ? bus::kRecordReaderProfile
                                                      : bus::kLatchedReaderProfile);
  }

  std::vector<Endpoint> made;

 private:
  void add_writer(Endpoint endpoint, const char* profile) {
    dds::DataWriterQos qos;
    publisher_.get_datawriter_qos_from_profile(profile, qos);
    endpoint.is_writer = true;
    endpoint.owner = std::string(profile) + " of " + file_;
    endpoint.participant.bytes[0] = 1;  // differs from the readers' participant
    fill(endpoint, qos, publisher_.get_qos());
    made.push_back(std::move(endpoint));
  }

  void add_reader(Endpoint endpoint, const char* profile) {
    dds::DataReaderQos qos;
    subscriber_.get_datareader_qos_from_profile(profile, qos);
    endpoint.owner = std::string(profile) + " of " + file_;
    endpoint.max_size = 0;
    fill(endpoint, qos, subscriber_.get_qos());
    made.push_back(std::move(endpoint));
  }

  dds::Publisher& publisher_;
  dds::Subscriber& subscriber_;
  const std::string file_;
};

}  // namespace

std::vector<Endpoint> make_own_endpoints(dds::Publisher& publisher, dds::Subscriber& subscriber,
                                         const std::string& file) {
  Maker maker(publisher, subscriber, file);
  maker.add<States, StatesPubSubType>();
  maker.add<Commands, CommandsPubSubType>();
  maker.add<RecordBatch, RecordBatchPubSubType>();
  maker.add<Participant, ParticipantPubSubType>();
  maker.add<Parameters, ParametersPubSubType>();
  maker.add<SimStatus, SimStatusPubSubType>();
  maker.add<SimControl, SimControlPubSubType>();
  maker.add<SimControlReply, SimControlReplyPubSubType>();
  return maker.made;
}

}  // namespace sls::doctor
