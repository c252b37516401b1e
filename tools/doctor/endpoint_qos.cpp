#include "tools/doctor/file_qos.hpp"

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

}  // namespace

std::vector<Endpoint> make_own_endpoints(dds::Publisher& publisher, dds::Subscriber& subscriber,
                                         const std::string& file) {
  std::vector<Endpoint> made;
  const auto add = [&](auto traits, auto&& type) {
    using Topic = decltype(traits);
    Endpoint writer;
    writer.topic = Topic::kName;
    writer.type = bus::name_of(type);
    Endpoint reader = writer;
    const char* profile = bus::find_writer_profile(Topic::kFlow);
    dds::DataWriterQos writer_qos;
    publisher.get_datawriter_qos_from_profile(profile, writer_qos);
    writer.is_writer = true;
    writer.max_size = bus::max_size_of(type);
    writer.owner = std::string(profile) + " of " + file;
    writer.participant.bytes[0] = 1;  // differs from the readers' participant
    fill(writer, writer_qos, publisher.get_qos());
    profile = Topic::kFlow == bus::Flow::kLoop     ? bus::kLoopReaderProfile
              : Topic::kFlow == bus::Flow::kRecord ? bus::kRecordReaderProfile
                                                   : bus::kLatchedReaderProfile;
    dds::DataReaderQos reader_qos;
    subscriber.get_datareader_qos_from_profile(profile, reader_qos);
    reader.owner = std::string(profile) + " of " + file;
    fill(reader, reader_qos, subscriber.get_qos());
    made.insert(made.end(), {writer, reader});
  };
  add(bus::Topic<States>(), StatesPubSubType());
  add(bus::Topic<Commands>(), CommandsPubSubType());
  add(bus::Topic<RecordBatch>(), RecordBatchPubSubType());
  add(bus::Topic<Participant>(), ParticipantPubSubType());
  add(bus::Topic<Parameters>(), ParametersPubSubType());
  add(bus::Topic<SimStatus>(), SimStatusPubSubType());
  add(bus::Topic<SimControl>(), SimControlPubSubType());
  add(bus::Topic<SimControlReply>(), SimControlReplyPubSubType());
  return made;
}

}  // namespace sls::doctor
