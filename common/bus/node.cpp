#include "common/bus/node.hpp"

#include <fastrtps/config.h>
#include <slsPubSubTypes.h>
#include <spdlog/spdlog.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <map>
#include <mutex>
#include <utility>

#include "common/bus/qos_file.hpp"
#include "common/bus/stale_segments.hpp"
#include "common/config/config_error.hpp"

namespace sls::bus {
namespace {

namespace dds = eprosima::fastdds::dds;
using config::ConfigError;
using eprosima::fastrtps::types::ReturnCode_t;

constexpr int kMaxDomain = 232;  // beyond, RTPS port numbers overflow

/// Sends the middleware's warnings and errors to our log on stderr (by itself it prints to stdout,
/// which is for data) and keeps the first error since `clear()`, which names the cause where those
/// that follow only say what failed because of it.
class LogCollector : public dds::LogConsumer {
 public:
  void Consume(const dds::Log::Entry& entry) override {
    if (entry.kind == dds::Log::Kind::Info) return;
    const std::lock_guard lock(mutex());
    if (entry.kind == dds::Log::Kind::Error && first_error().empty()) first_error() = entry.message;
    spdlog::debug("Fast DDS: {}", entry.message);
  }

  static void clear() { find_first_error(); }

  /// The first error since the last call of this or of `clear()`.
  static std::string find_first_error() {
    dds::Log::Flush();
    const std::lock_guard lock(mutex());
    return std::exchange(first_error(), {});
  }

 private:
  static std::mutex& mutex() {
    static std::mutex instance;
    return instance;
  }
  static std::string& first_error() {
    static auto& instance = *new std::string;  // the middleware may still log while we exit
    return instance;
  }
};

/// Loads a QoS file into the factory: one for the whole process, because profiles are global there.
void load_profiles(const std::filesystem::path& file, const std::string& identity) {
  static std::mutex mutex;
  static std::filesystem::path loaded;
  const std::lock_guard lock(mutex);
  const std::string profiles = read_qos_file(file, identity);
  const auto absolute = std::filesystem::canonical(file);
  if (absolute == loaded) return;
  if (!loaded.empty())  // Fast DDS would go on with the profiles it has, without a word
    throw ConfigError(file.string() + ": expected the QoS file that this process already uses, " +
                      loaded.string());
  // Only what the user names with --qos counts, not a stray DEFAULT_FASTRTPS_PROFILES.xml in the
  // working folder or an exported FASTRTPS_DEFAULT_PROFILES_FILE.
  setenv("SKIP_DEFAULT_XML_FILE", "1", 1);
  unsetenv("FASTRTPS_DEFAULT_PROFILES_FILE");
  dds::Log::ClearConsumers();
  dds::Log::RegisterConsumer(std::make_unique<LogCollector>());
  LogCollector::clear();
  auto* factory = dds::DomainParticipantFactory::get_instance();
  factory->load_profiles();
  if (factory->load_XML_profiles_string(profiles.data(), profiles.size()) !=
      ReturnCode_t::RETCODE_OK)
    throw ConfigError(file.string() + ": expected profiles that Fast DDS takes, got: " +
                      LogCollector::find_first_error());
  loaded = absolute;
}

PeerId to_peer(const dds::InstanceHandle_t& handle) {
  eprosima::fastrtps::rtps::GUID_t guid;
  eprosima::fastrtps::rtps::iHandle2GUID(guid, handle);
  PeerId peer;
  std::copy(std::begin(guid.guidPrefix.value), std::end(guid.guidPrefix.value), peer.bytes.begin());
  return peer;
}

/// Counts matched endpoints per participant, one of which may have several.
class MatchedPeers {
 public:
  void update(const dds::InstanceHandle_t& endpoint, int change) {
    const std::lock_guard lock(mutex_);
    const PeerId peer = to_peer(endpoint);
    if ((endpoints_[peer] += change) <= 0) endpoints_.erase(peer);
  }
  std::set<PeerId> peers() const {
    const std::lock_guard lock(mutex_);
    std::set<PeerId> peers;
    for (const auto& [peer, count] : endpoints_) peers.insert(peer);
    return peers;
  }

 private:
  mutable std::mutex mutex_;
  std::map<PeerId, int> endpoints_;
};

}  // namespace

struct Node::Impl {
  Impl(const std::filesystem::path& qos_file, int domain, const std::string& name,
       const std::string& identity)
      : qos_place(qos_file.string()) {
    if (domain < 0 || domain > kMaxDomain)
      throw ConfigError("--domain: expected 0 to " + std::to_string(kMaxDomain) + ", got " +
                        std::to_string(domain));
    load_profiles(qos_file, identity);
    auto* factory = dds::DomainParticipantFactory::get_instance();
    dds::DomainParticipantQos qos;
    if (factory->get_participant_qos_from_profile(kParticipantProfile, qos) !=
        ReturnCode_t::RETCODE_OK)
      throw_unknown_profile(kParticipantProfile);
    qos.name(name.c_str());
    LogCollector::clear();
    remove_stale_segments();
    auto& wire = qos.wire_protocol();
    if (wire.participant_id < 0)
      wire.participant_id = choose_participant_id(
          {wire.port.portBase + wire.port.domainIDGain * domain + wire.port.offsetd1,
           wire.port.participantIDGain});
    participant = factory->create_participant(static_cast<std::uint32_t>(domain), qos);
    if (participant)
      publisher = participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT),
      subscriber = participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
    if (!participant || !publisher || !subscriber)
      throw BusError("domain " + std::to_string(domain) +
                     ": cannot join: " + LogCollector::find_first_error());
  }

  ~Impl() {
    if (!participant) return;
    participant->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }

  [[noreturn]] void throw_unknown_profile(const char* profile) const {
    throw ConfigError(qos_place + ": profile '" + profile + "': expected a profile, got none");
  }

  /// The topic, shared by this node's writer and reader of it.
  dds::Topic* find_or_create_topic(const char* name, dds::TypeSupport type) {
    if (auto* known = participant->lookup_topicdescription(name))
      return static_cast<dds::Topic*>(known);
    // A TypeObject on the wire crashes peers that do not know the type (README.md, trap 1).
    type->auto_fill_type_object(false);
    type->auto_fill_type_information(false);
    dds::Topic* topic = nullptr;
    if (type.register_type(participant) == ReturnCode_t::RETCODE_OK)
      topic = participant->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
    if (!topic)
      throw BusError(std::string(name) +
                     ": cannot create the topic: " + LogCollector::find_first_error());
    return topic;
  }

  std::string qos_place;
  dds::DomainParticipant* participant = nullptr;
  dds::Publisher* publisher = nullptr;
  dds::Subscriber* subscriber = nullptr;
};

Node::Node(const std::filesystem::path& qos_file, int domain, const std::string& name,
           const std::string& identity)
    : impl_(std::make_unique<Impl>(qos_file, domain, name, identity)) {}
Node::~Node() = default;

const char* Node::choose_writer_profile(const char* profile, const char* fallback) const {
  dds::DataWriterQos qos;
  return impl_->publisher->get_datawriter_qos_from_profile(profile, qos) == ReturnCode_t::RETCODE_OK
             ? profile
             : fallback;
}

const char* Node::choose_reader_profile(const char* profile, const char* fallback) const {
  dds::DataReaderQos qos;
  return impl_->subscriber->get_datareader_qos_from_profile(profile, qos) ==
                 ReturnCode_t::RETCODE_OK
             ? profile
             : fallback;
}

PeerId Node::id() const { return to_peer(impl_->participant->get_instance_handle()); }

namespace detail {

// A DataWriter with a deadline needs a listener of its own, so every one has (README.md, trap 7).
struct AnyWriter::Impl : dds::DataWriterListener {
  void on_publication_matched(dds::DataWriter*,
                              const dds::PublicationMatchedStatus& status) override {
    peers.update(status.last_subscription_handle, status.current_count_change);
  }
  MatchedPeers peers;
  dds::Publisher* publisher = nullptr;
  dds::DataWriter* writer = nullptr;
};

AnyWriter::AnyWriter(Node& node, const char* topic, const char* profile, void* type_support)
    : impl_(std::make_unique<Impl>()) {
  dds::TypeSupport type(static_cast<dds::TopicDataType*>(type_support));
  auto* dds_topic = node.impl().find_or_create_topic(topic, type);
  impl_->publisher = node.impl().publisher;
  dds::DataWriterQos qos;
  if (impl_->publisher->get_datawriter_qos_from_profile(profile, qos) != ReturnCode_t::RETCODE_OK)
    node.impl().throw_unknown_profile(profile);
  LogCollector::clear();
  impl_->writer = impl_->publisher->create_datawriter(dds_topic, qos, impl_.get());
  if (!impl_->writer)
    throw ConfigError(node.impl().qos_place + ": profile '" + profile + "': expected QoS that " +
                      topic + " can have, got: " + LogCollector::find_first_error());
}

AnyWriter::~AnyWriter() {
  if (!impl_->writer) return;
  impl_->writer->set_listener(nullptr);
  // Otherwise a heartbeat to a reader that has died may meet a half-deleted history and never end
  // (README.md, trap 13).
  std::size_t removed = 0;
  impl_->writer->clear_history(&removed);
  impl_->publisher->delete_datawriter(impl_->writer);
}

bool AnyWriter::write(const void* sample) {
  return impl_->writer->write(const_cast<void*>(sample));  // Fast DDS only reads it
}

bool AnyWriter::wait_for_acknowledgments(std::chrono::milliseconds limit) {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limit);
  const auto rest = std::chrono::nanoseconds(limit - seconds);
  return impl_->writer->wait_for_acknowledgments({static_cast<std::int32_t>(seconds.count()),
                                                  static_cast<std::uint32_t>(rest.count())}) ==
         ReturnCode_t::RETCODE_OK;
}

std::set<PeerId> AnyWriter::matched() const { return impl_->peers.peers(); }

struct AnyReader::Impl : dds::DataReaderListener {
  void on_data_available(dds::DataReader* source) override {
    dds::SampleInfo info;
    while (source->take_next_sample(sample, &info) == ReturnCode_t::RETCODE_OK)
      if (info.valid_data) take(to_peer(info.publication_handle));
  }
  void on_subscription_matched(dds::DataReader*,
                               const dds::SubscriptionMatchedStatus& status) override {
    peers.update(status.last_publication_handle, status.current_count_change);
  }
  void on_requested_deadline_missed(dds::DataReader*,
                                    const dds::RequestedDeadlineMissedStatus& status) override {
    missed_deadlines = status.total_count;
  }
  MatchedPeers peers;
  std::atomic<std::uint64_t> missed_deadlines{0};
  std::optional<std::chrono::nanoseconds> lifespan;
  void* sample = nullptr;
  Take take;
  dds::Subscriber* subscriber = nullptr;
  dds::DataReader* reader = nullptr;
};

AnyReader::AnyReader(Node& node, const char* topic, const char* profile, void* type_support,
                     void* sample, Take take)
    : impl_(std::make_unique<Impl>()) {
  dds::TypeSupport type(static_cast<dds::TopicDataType*>(type_support));
  auto* dds_topic = node.impl().find_or_create_topic(topic, type);
  impl_->sample = sample;
  impl_->take = std::move(take);
  impl_->subscriber = node.impl().subscriber;
  dds::DataReaderQos qos;
  if (impl_->subscriber->get_datareader_qos_from_profile(profile, qos) != ReturnCode_t::RETCODE_OK)
    node.impl().throw_unknown_profile(profile);
  const auto& lifespan = qos.lifespan().duration;
  if (!(lifespan == eprosima::fastrtps::c_TimeInfinite))
    impl_->lifespan = std::chrono::nanoseconds(lifespan.to_ns());
  LogCollector::clear();
  impl_->reader = impl_->subscriber->create_datareader(dds_topic, qos, impl_.get());
  if (!impl_->reader)
    throw ConfigError(node.impl().qos_place + ": profile '" + profile + "': expected QoS that " +
                      topic + " can have, got: " + LogCollector::find_first_error());
}

AnyReader::~AnyReader() {
  if (!impl_->reader) return;
  impl_->reader->set_listener(nullptr);
  impl_->subscriber->delete_datareader(impl_->reader);
}

std::set<PeerId> AnyReader::matched() const { return impl_->peers.peers(); }
std::uint64_t AnyReader::missed_deadlines() const { return impl_->missed_deadlines; }
std::optional<std::chrono::nanoseconds> AnyReader::lifespan() const { return impl_->lifespan; }

template <>
void* make_type_support<VehicleState>() {
  return static_cast<dds::TopicDataType*>(new VehicleStatePubSubType);
}
template <>
void* make_type_support<ControlCommand>() {
  return static_cast<dds::TopicDataType*>(new ControlCommandPubSubType);
}
template <>
void* make_type_support<Reference>() {
  return static_cast<dds::TopicDataType*>(new ReferencePubSubType);
}
template <>
void* make_type_support<Participant>() {
  return static_cast<dds::TopicDataType*>(new ParticipantPubSubType);
}
template <>
void* make_type_support<Parameters>() {
  return static_cast<dds::TopicDataType*>(new ParametersPubSubType);
}
template <>
void* make_type_support<SimStatus>() {
  return static_cast<dds::TopicDataType*>(new SimStatusPubSubType);
}
template <>
void* make_type_support<SimControl>() {
  return static_cast<dds::TopicDataType*>(new SimControlPubSubType);
}
template <>
void* make_type_support<SimControlReply>() {
  return static_cast<dds::TopicDataType*>(new SimControlReplyPubSubType);
}

}  // namespace detail

std::string middleware_version() { return FASTRTPS_VERSION_STR; }

}  // namespace sls::bus
