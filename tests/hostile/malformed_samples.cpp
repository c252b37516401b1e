// Uses Fast DDS directly: the project's own types cannot produce malformed samples.
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include <algorithm>
#include <chrono>
#include <map>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

#include "common/bus/topics.hpp"
#include "fastdds_types.hpp"
#include "tests/hostile/attack.hpp"

namespace sls::hostile {
namespace {

using namespace std::chrono_literals;
namespace dds = bus::dds;
namespace rtps = bus::rtps;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint32_t kHuge = 8 << 20;
constexpr std::size_t kMostHuge = 20;

/// Raw bytes, sent under the name of any type.
class RawType : public bus::WrittenType {
 public:
  explicit RawType(const std::string& name) : WrittenType(name, kHuge) {}

 protected:
  bool write(const void* data, rtps::SerializedPayload_t& payload) const override {
    const auto& bytes = *static_cast<const Bytes*>(data);
    std::copy(bytes.begin(), bytes.end(), payload.data);
    payload.length = static_cast<std::uint32_t>(bytes.size());
    return true;
  }
  std::uint32_t size(const void* data) const override {
    return static_cast<std::uint32_t>(static_cast<const Bytes*>(data)->size());
  }
};

template <class Message>
const char* topic_of() {
  return bus::Topic<Message>::kName;
}

Bytes make_malformed(std::mt19937_64& random) {
  Bytes bytes(4 + random() % 2000);
  const bool is_of_ones = random() % 2;  // every length field is huge
  for (auto& byte : bytes) byte = is_of_ones ? 0xff : static_cast<std::uint8_t>(random());
  if (random() % 4) std::copy_n("\0\1\0\0", 4, bytes.begin());  // valid encapsulation
  bytes.resize(random() % 8 ? bytes.size() : random() % 8);
  return bytes;
}

/// Zeros with one length field: as many vehicles, entries or numbers as the sample has bytes.
Bytes make_claim(std::mt19937_64& random) {
  Bytes bytes(1000 + random() % 140'000);
  bytes[1] = 1;                              // little-endian
  const auto at = 4 * (1 + random() % 100);  // where a sequence of some type may begin
  for (std::size_t i = 0; i < 4; ++i)
    bytes[at + i] = static_cast<std::uint8_t>(bytes.size() >> 8 * i);
  return bytes;
}

}  // namespace

std::uint64_t write_malformed(const Target& target) {
  const std::map<std::string, std::string> types = {
      {topic_of<States>(), "sls::States"},
      {topic_of<Commands>(), "sls::Commands"},
      {topic_of<RecordBatch>(), "sls::RecordBatch"},
      {topic_of<Participant>(), "sls::Participant"},
      {topic_of<Parameters>(), "sls::Parameters"},
      {topic_of<SimStatus>(), "sls::SimStatus"},
      {topic_of<SimControl>(), "sls::SimControl"},
      {topic_of<SimControlReply>(), "sls::SimControlReply"}};
  auto* factory = dds::DomainParticipantFactory::get_instance();
  auto* participant = factory->create_participant(static_cast<std::uint32_t>(target.domain),
                                                  dds::PARTICIPANT_QOS_DEFAULT);
  if (!participant) throw std::runtime_error("no participant");
  auto* publisher = participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  dds::DataWriterQos qos;
  qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = dds::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().depth = 8;
  qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_RESERVE_MEMORY_MODE;
  std::vector<dds::DataWriter*> writers;
  for (const auto& [topic, type] : types) {
    dds::TypeSupport support(new RawType(type));
    bus::leave_out_type_object(support);
    support.register_type(participant);
    writers.push_back(publisher->create_datawriter(
        participant->create_topic(topic, type, dds::TOPIC_QOS_DEFAULT), qos));
    if (!writers.back()) throw std::runtime_error("no writer of " + topic);
  }

  std::mt19937_64 random(target.seed);
  std::uint64_t count = 0;
  std::size_t huge = 0;
  while (goes_on(target)) {
    auto* writer = writers[random() % writers.size()];
    Bytes bytes = random() % 20 ? make_malformed(random) : make_claim(random);
    if (count % 200 == 0 && huge < kMostHuge) {
      bytes.assign(huge % 2 ? kHuge : 64000, 'x');
      std::copy_n("\0\1\0\0", 4, bytes.begin());
      ++huge;
    }
    if (bus::write_sample(*writer, &bytes)) ++count;
    say_that_it_fires();
    std::this_thread::sleep_for(500us);
  }
  participant->delete_contained_entities();
  factory->delete_participant(participant);
  return count;
}

}  // namespace sls::hostile
