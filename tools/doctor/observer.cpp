#include "tools/doctor/observer.hpp"

#include <doctorPubSubTypes.h>
#include <slsPubSubTypes.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>

#include <array>
#include <mutex>
#include <set>
#include <utility>

#include "common/bus/fastdds/facts_of.hpp"
#include "common/bus/fastdds/guarded_transports.hpp"
#include "common/bus/fastdds/middleware_log.hpp"
#include "common/bus/fastdds/participant_ids.hpp"
#include "common/bus/fastdds/participant_listener.hpp"
#include "common/bus/fastdds/stale_segments.hpp"
#include "common/bus/node.hpp"
#include "common/bus/topics.hpp"
#include "fastdds_announcements.hpp"
#include "fastdds_api.hpp"
#include "tools/doctor/file_qos.hpp"
#include "tools/doctor/probe.hpp"
#include "tools/doctor/udp_socket.hpp"

namespace sls::doctor {
namespace {

namespace dds = bus::dds;
namespace rtps = bus::rtps;
using bus::is_ok;
using bus::to_peer;
using Clock = std::chrono::steady_clock;

constexpr const char* kDoctorTopic = "sls/doctor";
constexpr std::array<std::uint32_t, 3> kEchoSizes = {200, 8000, 60000};

/// Samples kept for late joiners arrive within this time after matching; later ones are new.
constexpr auto kHistoryTime = std::chrono::seconds(1);

/// Makes discovery contact `peer` directly, too. Otherwise a network without multicast would hide
/// all other findings.
void add_peer(dds::DomainParticipantQos& qos, const Ports& ports, const std::string& peer) {
  auto& builtin = qos.wire_protocol().builtin;
  if (builtin.discovery_config.discoveryProtocol != rtps::DiscoveryProtocol::SIMPLE) return;
  rtps::Locator_t locator;
  locator.kind = LOCATOR_KIND_UDPv4;
  if (uses_default_multicast(qos)) {
    rtps::IPLocator::setIPv4(locator, kMulticastGroup);
    locator.port = static_cast<std::uint32_t>(ports.multicast());
    builtin.initialPeersList.push_back(locator);
  }
  rtps::IPLocator::setIPv4(locator, peer);
  for (int id = 0; id <= kHighestProbeId; ++id) {
    locator.port = static_cast<std::uint32_t>(ports.metatraffic(id));
    builtin.initialPeersList.push_back(locator);
  }
}

std::string find_property(const bus::ParticipantNews& news, const char* name) {
  const auto property = news.properties.find(name);
  return property == news.properties.end() ? "" : property->second;
}

}  // namespace

struct Observer::Impl : bus::ParticipantListener {
  /// Listener of a reader on a latched topic; notes when each participant's writer matched.
  struct Listener : dds::DataReaderListener {
    explicit Listener(Impl& observer) : impl(observer) {}
    void on_subscription_matched(dds::DataReader*,
                                 const dds::SubscriptionMatchedStatus& status) override {
      const std::lock_guard lock(impl.mutex);
      const bus::PeerId peer = to_peer(status.last_publication_handle);
      if (status.current_count_change > 0) matched.emplace(peer, Clock::now());
    }
    Impl& impl;
    std::map<bus::PeerId, Clock::time_point> matched;
  };

  template <class Message>
  struct Told : Listener {
    using Listener::Listener;
    void on_data_available(dds::DataReader* reader) override {
      dds::SampleInfo info;
      while (is_ok(reader->take_next_sample(&buffer, &info))) {
        if (!info.valid_data) continue;
        const std::lock_guard lock(this->impl.mutex);
        this->impl.note_sample(*this, info);
      }
    }
    Message buffer;
  };

  struct Echo : dds::DataReaderListener {
    explicit Echo(Impl& observer) : impl(observer) {}
    void on_data_available(dds::DataReader* reader) override {
      dds::SampleInfo info;
      while (is_ok(reader->take_next_sample(&buffer, &info))) {
        if (!info.valid_data || buffer.payload().size() != buffer.size()) continue;
        const std::lock_guard lock(impl.mutex);
        if (!buffer.is_answer() && impl.options.is_answering)
          impl.questions.push_back(buffer);
        else if (buffer.is_answer() && buffer.nonce() == impl.nonce)
          impl.echoes[buffer.size()] = true;
      }
    }
    Impl& impl;
    DoctorProbe buffer;
  };

  Impl(const Options& wanted, dds::DomainParticipantQos qos)
      : bus::ParticipantListener({is_secured(qos)}), options(wanted) {
    const Ports ports = find_ports(qos, options.domain);
    qos.name(kDoctorName);
    if (!options.peer_address.empty()) add_peer(qos, ports, options.peer_address);
    auto& wire = qos.wire_protocol();
    if (wire.participant_id < 0)
      wire.participant_id = bus::choose_participant_id(
          {ports.metatraffic(0), ports.participant_gain}, bus::find_own_participant_ids());
    hear(qos);
    bus::MiddlewareLog::clear();
    participant = bus::create_participant(options.domain, qos, this);
    if (!participant)
      throw bus::BusError("domain " + std::to_string(options.domain) +
                          ": cannot join: " + bus::MiddlewareLog::find_first_error());
    set_self(to_peer(participant->get_instance_handle()));
    publisher = participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber = participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
    if (!options.is_answering) {
      listen<ParticipantPubSubType>(bus::Topic<Participant>::kName, participants);
      listen<ParametersPubSubType>(bus::Topic<Parameters>::kName, parameters);
      listen<SimStatusPubSubType>(bus::Topic<SimStatus>::kName, statuses);
      for (const std::uint32_t size : kEchoSizes) echoes[size] = false;
    }
    bus::MiddlewareLog::clear();
    dds::DataWriterQos writer_qos;
    publisher->get_datawriter_qos_from_profile(bus::kLatchedWriterProfile, writer_qos);
    dds::Topic* topic = make_topic<DoctorProbePubSubType>(kDoctorTopic);
    writer = topic ? publisher->create_datawriter(topic, writer_qos, &writer_listener) : nullptr;
    if (!listen<DoctorProbePubSubType>(kDoctorTopic, echo) || !writer)
      refusal = "the middleware refused " + std::string(kDoctorTopic) + ": " +
                bus::MiddlewareLog::find_first_error();
  }

  ~Impl() override {
    participant->set_listener(nullptr);
    participant->delete_contained_entities();
    const bus::LeavingScope leaving(*participant);
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }

  template <class PubSubType>
  dds::Topic* make_topic(const char* name) {
    if (auto* known = participant->lookup_topicdescription(name))
      return static_cast<dds::Topic*>(known);
    dds::TypeSupport type(new PubSubType);
    bus::leave_out_type_object(type);
    type.register_type(participant);
    return participant->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  }

  template <class PubSubType>
  bool listen(const char* name, dds::DataReaderListener& listener) {
    dds::DataReaderQos qos;
    subscriber->get_datareader_qos_from_profile(bus::kLatchedReaderProfile, qos);
    dds::Topic* topic = make_topic<PubSubType>(name);
    return topic && subscriber->create_datareader(topic, qos, &listener);
  }

  void note_sample(const Listener& topic, const dds::SampleInfo& info) {
    const bus::PeerId sender = to_peer(info.publication_handle);
    const auto program = programs.find(sender);
    const auto matched = topic.matched.find(sender);
    if (program == programs.end()) return;
    ++program->second.samples;
    if (matched == topic.matched.end() || Clock::now() < matched->second + kHistoryTime) return;
    const auto delay =
        std::chrono::nanoseconds(info.reception_timestamp.to_ns() - info.source_timestamp.to_ns());
    auto& least = program->second.delay;
    if (!least || std::chrono::abs(delay) < std::chrono::abs(*least)) least = delay;
  }

  void on_participant(const dds::DomainParticipant* source,
                      const bus::ParticipantNews& news) override {
    bus::ParticipantListener::on_participant(source, news);
    const std::lock_guard lock(mutex);  // `participant` may not be set yet: not used here
    const bus::PeerId id = to_peer(news.guid);
    if (news.kind == bus::ParticipantNews::Kind::kGone) {
      programs.erase(id);
      return;
    }
    Program& program = programs[id];
    program.id = id;
    program.name = news.name;
    program.user = find_property(news, dds::parameter_policy_physical_data_user);
    program.is_on_this_host = news.guid.is_on_same_host_as(source->guid());
    program.is_secured = news.identity.has_value();
    program.udp_ports.clear();
    program.shared_memory_ports.clear();
    for (const auto& locator : news.addresses) {
      if (locator.kind == LOCATOR_KIND_SHM) program.shared_memory_ports.push_back(locator.port);
      if (locator.kind != LOCATOR_KIND_UDPv4) continue;
      program.udp_ports.push_back(locator.port);
      program.address = rtps::IPLocator::ip_to_string(locator);
    }
  }

  void on_announcement(const bus::PlainAnnouncement& other, const std::string& address) override {
    bus::ParticipantListener::on_announcement(other, address);
    const std::lock_guard lock(mutex);
    Program& program = programs[other.sender];  // of one that is discovered: nothing new
    program.id = other.sender;
    program.name = other.name;
    program.is_secured = other.is_secured;
    if (program.address.empty()) program.address = address;
  }

  void on_authentication(const rtps::GUID_t& other, bool is_accepted) override {
    const std::lock_guard lock(mutex);
    if (!is_accepted) rejected.insert(to_peer(other));
    bus::ParticipantListener::on_authentication(other, is_accepted);
  }

  void on_endpoint(const bus::EndpointNews& news) override {
    const std::lock_guard lock(mutex);
    if (news.is_gone)
      endpoints.erase(news.guid);
    else
      endpoints[news.guid] = {news.facts, to_peer(news.guid), {}, news.max_size};
  }

  const Options options;
  const std::uint64_t nonce = choose_nonce();
  std::mutex mutex;
  std::map<bus::PeerId, Program> programs;
  std::set<bus::PeerId> rejected;
  std::map<rtps::GUID_t, Endpoint> endpoints;
  std::map<std::uint32_t, bool> echoes;
  std::vector<DoctorProbe> questions;
  std::string refusal;

  Told<Participant> participants{*this};
  Told<Parameters> parameters{*this};
  Told<SimStatus> statuses{*this};
  Echo echo{*this};
  dds::DataWriterListener writer_listener;  // common/bus/fastdds/README.md, trap 7
  dds::DomainParticipant* participant = nullptr;
  dds::Publisher* publisher = nullptr;
  dds::Subscriber* subscriber = nullptr;
  dds::DataWriter* writer = nullptr;
};

Observer::Observer(const Options& options)
    : impl_(std::make_unique<Impl>(options,
                                   load_participant_qos(options.qos_file, options.identity))) {}
Observer::~Observer() = default;

void Observer::ask() {
  if (!impl_->writer) return;
  for (const auto& [size, is_back] : echoes()) {
    if (is_back) continue;
    DoctorProbe probe;
    probe.nonce(impl_->nonce);
    probe.size(size);
    probe.payload().resize(size);
    bus::write_sample(*impl_->writer, &probe);
  }
}

void Observer::answer() {
  std::vector<DoctorProbe> questions;
  {
    const std::lock_guard lock(impl_->mutex);
    questions.swap(impl_->questions);
  }
  for (DoctorProbe& probe : questions) {
    probe.is_answer(true);
    if (impl_->writer) bus::write_sample(*impl_->writer, &probe);
  }
}

std::vector<Program> Observer::programs() const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<Program> all;
  for (auto [id, program] : impl_->programs) {
    program.is_rejected = impl_->rejected.count(id) != 0;
    for (const Impl::Listener* topic : {static_cast<const Impl::Listener*>(&impl_->participants),
                                        static_cast<const Impl::Listener*>(&impl_->parameters),
                                        static_cast<const Impl::Listener*>(&impl_->statuses)})
      program.is_expected |= topic->matched.count(id) != 0;
    all.push_back(std::move(program));
  }
  for (const bus::PeerId& id : impl_->rejected) {
    if (impl_->programs.count(id) != 0) continue;
    Program unknown;
    unknown.id = id;
    unknown.is_rejected = true;
    all.push_back(std::move(unknown));
  }
  return all;
}

std::vector<Endpoint> Observer::endpoints() const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<Endpoint> all;
  for (const auto& [guid, endpoint] : impl_->endpoints) all.push_back(endpoint);
  return all;
}

std::vector<Endpoint> Observer::own_endpoints() const {
  return make_own_endpoints(*impl_->publisher, *impl_->subscriber,
                            impl_->options.qos_file.filename().string());
}

std::map<std::uint32_t, bool> Observer::echoes() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->echoes;
}

const std::string& Observer::refusal() const { return impl_->refusal; }

}  // namespace sls::doctor
