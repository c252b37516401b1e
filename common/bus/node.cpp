#include "common/bus/node.hpp"

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
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

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <sys/statvfs.h>
#include <algorithm>
#include <atomic>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <string_view>
#include <system_error>

#include "common/bus/environment.hpp"
#include "common/bus/fastdds/data_sharing.hpp"
#include "common/bus/fastdds/discovered_participants.hpp"
#include "common/bus/fastdds/facts_of.hpp"
#include "common/bus/fastdds/guarded_transports.hpp"
#include "common/bus/fastdds/guarded_type.hpp"
#include "common/bus/fastdds/host_id.hpp"
#include "common/bus/fastdds/middleware_log.hpp"
#include "common/bus/fastdds/neighbours.hpp"
#include "common/bus/fastdds/participant_ids.hpp"
#include "common/bus/fastdds/participant_listener.hpp"
#include "common/bus/fastdds/shared_locks.hpp"
#include "common/bus/fastdds/stale_segments.hpp"
#include "common/bus/fastdds/transports.hpp"
#include "common/bus/qos_file.hpp"
#include "common/bus/security_files.hpp"
#include "common/config/config_error.hpp"
#include "common/config/domain.hpp"
#include "fastdds_announcements.hpp"
#include "fastdds_api.hpp"

namespace sls::bus {
namespace {

using config::ConfigError;

/// On one domain. Each announced participant costs memory and packets, even a forged one: with
/// 3,000 of these the middleware hangs (tests/hostile/README.md).
constexpr std::size_t kMaxParticipants = 64;

/// Bytes on the wire around the vehicles of a loop sample: headers, a heartbeat and the additions
/// of encryption.
constexpr std::size_t kEnvelopeBytes = 200;

constexpr const char* kCertificate = "dds.sec.auth.builtin.PKI-DH.identity_certificate";
constexpr const char* kIdentityAuthority = "dds.sec.auth.builtin.PKI-DH.identity_ca";
constexpr const char* kGovernance = "dds.sec.access.builtin.Access-Permissions.governance";
constexpr const char* kPermissions = "dds.sec.access.builtin.Access-Permissions.permissions";

}  // namespace

void load_profiles(const std::filesystem::path& file, const std::string& identity) {
  static std::mutex mutex;
  static std::filesystem::path loaded;
  const std::lock_guard lock(mutex);
  const std::string profiles = read_qos_file(file, identity);
  const SecurityFiles security = check_security_files(profiles);
  const auto absolute = std::filesystem::canonical(file);
  if (absolute == loaded) return;
  if (!loaded.empty())  // Fast DDS would silently keep its profiles
    throw ConfigError(file.string() + ": expected the QoS file that this process already uses, " +
                      loaded.string());
  // Only the file of --qos counts, not a stray file with default profiles in the working folder or
  // one that the environment names.
  setenv("SKIP_DEFAULT_XML_FILE", "1", 1);
  drop_foreign_variables();
  if (!security.expiry.empty()) spdlog::warn("{}", security.expiry);
  MiddlewareLog::start(security.is_secured);
  auto* factory = dds::DomainParticipantFactory::get_instance();
  factory->load_profiles();
  if (!is_ok(factory->load_XML_profiles_string(profiles.data(), profiles.size())))
    throw ConfigError(describe_refusal(file, MiddlewareLog::find_first_error()));
  loaded = absolute;
}

namespace {

/// The sample that contains `payload`. A reader of Fast DDS passes only payloads inside a sample to
/// a type.
const rtps::CacheChange_t& find_change(const rtps::SerializedPayload_t& payload) {
  using Change = rtps::CacheChange_t;
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Winvalid-offsetof"  // it has no base class
  constexpr std::size_t kOffset = offsetof(Change, serializedPayload);
#pragma GCC diagnostic pop
  return *reinterpret_cast<const Change*>(reinterpret_cast<const char*>(&payload) - kOffset);
}

/// Counts matched endpoints per participant; a participant may have several.
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
       const std::string& role, Transports transports)
      : qos_place(qos_file.string()), identity(find_identity(role)) {
    if (domain < 0 || domain > config::kMaxDomain)
      throw ConfigError("--domain: expected 0 to " + std::to_string(config::kMaxDomain) + ", got " +
                        std::to_string(domain));
    load_profiles(qos_file, role);
    auto* factory = dds::DomainParticipantFactory::get_instance();
    dds::DomainParticipantQos qos;
    if (!is_ok(factory->get_participant_qos_from_profile(kParticipantProfile, qos)))
      throw_unknown_profile(kParticipantProfile);
    qos.name(name.c_str());
    is_secured = rtps::PropertyPolicyHelper::find_property(qos.properties(),
                                                           "dds.sec.auth.plugin") != nullptr;
    if (transports == Transports::kNetwork) leave_out_shared_memory(qos);
    if (transports == Transports::kAll) shorten_queue(qos.transport());
    is_on_this_machine = are_local(qos.transport());
    has_memory_of_machine = is_on_this_machine && has_shared_memory(qos);
    const std::uint32_t most_sent = limit_datagrams(qos);
    auto& participants = qos.allocation().participants;
    participants.maximum = std::min(participants.maximum, kMaxParticipants);
    check_environment(qos, domain);
    MiddlewareLog::clear();
    remove_stale_segments();
    expect_room(qos);
    auto& wire = qos.wire_protocol();
    // A node without shared memory leaves no port files, so its id would look free to the next one.
    ports = {wire.port.portBase + wire.port.domainIDGain * domain + wire.port.offsetd1,
             wire.port.participantIDGain};
    if (wire.participant_id < 0 && has_shared_memory(qos))
      wire.participant_id = choose_participant_id(ports, find_own_participant_ids());
    ParticipantListener::Own own;
    own.has_memory = has_shared_memory(qos);
    if (is_secured) {
      const std::filesystem::path governance = find_file(qos, kGovernance);
      own.is_secured = true;
      own.is_for_fastdds_alone = !are_submessages_protected(governance);
    }
    announce_what_discovery_lacks(qos);
    listener = std::make_unique<ParticipantListener>(own, &neighbours, &discovered);
    listener->hear(qos);
    participant = create_participant(domain, qos, listener.get(), most_sent);
    if (participant)
      publisher = participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT),
      subscriber = participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
    if (!participant || !publisher || !subscriber)
      throw BusError("domain " + std::to_string(domain) +
                     ": cannot join: " + MiddlewareLog::find_first_error());
    self = to_peer(participant->get_instance_handle());
    listener->set_self(self);
    joined = std::chrono::steady_clock::now();
  }

  ~Impl() {
    if (!participant) return;
    participant->set_listener(nullptr);
    if (is_refused) return;
    participant->delete_contained_entities();
    const LeavingScope leaving(*participant);
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }

  /// Adds properties about this participant that others need.
  void announce_what_discovery_lacks(dds::DomainParticipantQos& qos) const {
    auto& properties = qos.properties().properties();
    properties.emplace_back(kVersionProperty, kMiddlewareVersion, true);
    if (has_shared_memory(qos))
      properties.emplace_back(kMemoryProperty, std::to_string(middleware_build()), true);
    if (!is_secured) return;
    properties.emplace_back(kProcessProperty, Refusals::name_process(), true);
    use_common_algorithms(qos);
    const IdentityNames names =
        find_identity_names(find_file(qos, kCertificate), find_file(qos, kIdentityAuthority));
    properties.emplace_back(kCertificateProperty, names.certificate, true);
    properties.emplace_back(kAuthorityProperty, names.authority, true);
  }

  /// Size of the largest handshake message of DDS Security, which is never fragmented. With the
  /// keys of `./sls keys` it has 5,500 bytes, mostly certificate and signed permissions.
  static std::size_t calc_handshake_bytes(const dds::DomainParticipantQos& qos) {
    constexpr std::size_t kLeast = 6'000, kBesides = 2'000;
    std::size_t bytes = kBesides;
    for (const char* name : {kCertificate, kPermissions}) {
      std::error_code error;
      const auto size = std::filesystem::file_size(find_file(qos, name), error);
      if (!error) bytes += static_cast<std::size_t>(size);
    }
    return std::max(kLeast, bytes);
  }

  /// Most bytes of an outgoing datagram by the property sls.max_datagram_bytes of the profile; 0 if
  /// it is not set.
  std::uint32_t limit_datagrams(const dds::DomainParticipantQos& qos) {
    constexpr const char* kProperty = "sls.max_datagram_bytes";
    constexpr std::size_t kLeast = 600;  // a vehicle fits
    const auto* text = rtps::PropertyPolicyHelper::find_property(qos.properties(), kProperty);
    if (!text) return 0;
    std::size_t bytes = 0;
    const char* end = text->data() + text->size();
    const auto [rest, error] = std::from_chars(text->data(), end, bytes);
    if (error != std::errc() || rest != end || bytes < kLeast || bytes > max_datagram_bytes)
      throw ConfigError(qos_place + ": property " + kProperty + ": expected " +
                        std::to_string(kLeast) + " to " + std::to_string(max_datagram_bytes) +
                        ", got '" + *text + "'");
    max_datagram_bytes = bytes;
    return static_cast<std::uint32_t>(is_secured ? std::max(bytes, calc_handshake_bytes(qos))
                                                 : bytes);
  }

  /// The file that a property of DDS Security names as file://…; empty if it names none.
  static std::filesystem::path find_file(const dds::DomainParticipantQos& qos,
                                         const char* property) {
    constexpr std::string_view kScheme = "file://";
    const auto* place = rtps::PropertyPolicyHelper::find_property(qos.properties(), property);
    return place && place->rfind(kScheme, 0) == 0 ? place->substr(kScheme.size()) : "";
  }

  static bool has_shared_memory(const dds::DomainParticipantQos& qos) {
    const auto& own = qos.transport().user_transports;
    return qos.transport().use_builtin_transports ||
           std::any_of(own.begin(), own.end(), is_shared_memory);
  }

  void check_environment(const dds::DomainParticipantQos& qos, int domain) {
    const auto& port = qos.wire_protocol().port;
    environment.domain = domain;
    environment.port_base = port.portBase;
    environment.domain_gain = port.domainIDGain;
    environment.uses_shared_memory = has_shared_memory(qos);
    environment.is_local = is_on_this_machine;
    environment.most_participants = qos.allocation().participants.maximum;
    const Environment seen = look_around(environment);
    environment.addresses_at_start = seen.addresses;
    if (const std::string error = find_cause(seen, true); !error.empty()) throw BusError(error);
  }

  /// Fast DDS finds no room only when it writes, and then the process dies of SIGBUS.
  static void expect_room(const dds::DomainParticipantQos& qos) {
    constexpr double kBesides = 1e6;  // bytes: ports and bookkeeping
    struct statvfs room {};
    if (!has_shared_memory(qos) || ::statvfs("/dev/shm", &room) != 0) return;
    double need = rtps::SharedMemTransportDescriptor().segment_size();
    for (const auto& transport : qos.transport().user_transports)
      if (const auto memory =
              std::dynamic_pointer_cast<rtps::SharedMemTransportDescriptor>(transport))
        need = memory->segment_size();
    need += kBesides + (can_share_data && are_local(qos.transport()) ? kMostSharedData : 0);
    const double free = static_cast<double>(room.f_bavail) * static_cast<double>(room.f_frsize);
    if (free < need)
      throw BusError(fmt::format("/dev/shm: expected {:.1f} MB free, got {:.1f} MB", need * 1e-6,
                                 free * 1e-6) +
                     ": mount -o remount,size=64M /dev/shm (docker run --shm-size 64m), or --qos "
                     "config/qos/udp.xml");
  }

  static void leave_out_shared_memory(dds::DomainParticipantQos& qos) {
    auto& transport = qos.transport();
    auto& own = transport.user_transports;
    own.erase(std::remove_if(own.begin(), own.end(), is_shared_memory), own.end());
    if (transport.use_builtin_transports || own.empty())
      own.push_back(std::make_shared<rtps::UDPv4TransportDescriptor>());
    transport.use_builtin_transports = false;
  }

  /// Returns whether the endpoint will share data. Fast DDS shares none of histories that grow.
  template <class Qos>
  bool choose_data_sharing(Qos& qos) const {
    if (!bus::choose_data_sharing(qos.data_sharing(), has_memory_of_machine)) return false;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_MEMORY_MODE;
    return true;
  }

  [[noreturn]] void throw_unknown_profile(const char* profile) const {
    throw ConfigError(qos_place + ": profile '" + profile + "': expected a profile, got none");
  }

  /// Throws the reason why the middleware created no writer or reader of `topic`; `verb` is "write"
  /// or "read".
  [[noreturn]] void throw_refused_endpoint(const char* verb, const char* topic,
                                           const char* profile) {
    is_refused = is_secured;
    const std::string cause = MiddlewareLog::find_first_error();
    if (cause.find("topic not found in allow rule") != std::string::npos ||
        cause.find("topic denied by deny rule") != std::string::npos) {
      throw ConfigError(qos_place + ": identity '" + identity + "': expected permission to " +
                        verb + " " + topic + ", got none");
    }
    throw ConfigError(qos_place + ": profile '" + profile + "': expected QoS that " + topic +
                      " can have, got: " + cause);
  }

  /// The topic, shared by this node's writer and reader of it.
  dds::Topic* find_or_create_topic(const char* name, dds::TypeSupport type) {
    if (auto* known = participant->lookup_topicdescription(name))
      return static_cast<dds::Topic*>(known);
    // Topics of one type share its type support: Fast DDS refuses a second one of the same name.
    const dds::TypeSupport known_type = participant->find_type(type.get_type_name());
    if (!known_type.empty()) type = known_type;
    leave_out_type_object(type);
    dds::Topic* topic = nullptr;
    if (is_ok(type.register_type(participant)))
      topic = participant->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
    if (!topic)
      throw BusError(std::string(name) +
                     ": cannot create the topic: " + MiddlewareLog::find_first_error());
    return topic;
  }

  const std::string qos_place;
  std::string identity;
  bool is_secured = false;
  // An endpoint was refused, and the process will end. The others may be matched at this moment;
  // they are not deleted, because Fast DDS would use them (fastdds/README.md, trap 42).
  bool is_refused = false;
  bool is_on_this_machine = false;
  bool has_memory_of_machine = false;       // shared memory and loopback are its only transports
  std::size_t max_datagram_bytes = 60'000;  // of UDP on loopback, and of shared memory
  std::chrono::steady_clock::time_point joined;
  Problems problems;
  Neighbours neighbours{problems};
  ParticipantPorts ports;
  DiscoveredParticipants discovered;
  PeerId self;
  Environment environment;  // as it was given, and the addresses at the start
  std::unique_ptr<ParticipantListener> listener;
  dds::DomainParticipant* participant = nullptr;
  dds::Publisher* publisher = nullptr;
  dds::Subscriber* subscriber = nullptr;
};

Node::Node(const std::filesystem::path& qos_file, int domain, const std::string& name,
           const std::string& identity, Transports transports)
    : impl_(std::make_unique<Impl>(qos_file, domain, name, identity, transports)) {}
Node::~Node() { is_leaving = true; }

const char* Node::choose_writer_profile(const char* profile, const char* fallback) const {
  dds::DataWriterQos qos;
  return is_ok(impl_->publisher->get_datawriter_qos_from_profile(profile, qos)) ? profile
                                                                                : fallback;
}

const char* Node::choose_reader_profile(const char* profile, const char* fallback) const {
  dds::DataReaderQos qos;
  return is_ok(impl_->subscriber->get_datareader_qos_from_profile(profile, qos)) ? profile
                                                                                 : fallback;
}

bool Node::stays_on_this_machine() const { return impl_->is_on_this_machine; }

bool Node::has_discovered_this_machine() const {
  // One is our own: it need not follow from our participant id, because of two processes that start
  // together one gets the next port.
  return impl_->discovered.find_unknown(find_open_ports(impl_->ports)).size() <= 1;
}

std::set<PeerId> Node::find_named(const std::string& name) const {
  return impl_->discovered.find_named(name);
}

std::size_t Node::max_batch_bytes() const {
  constexpr std::size_t kMost = 12'000;
  return impl_->is_secured ? std::min(kMost, max_sample_bytes()) : kMost;
}

std::size_t Node::max_sample_bytes() const { return impl_->max_datagram_bytes - kEnvelopeBytes; }

std::string Node::describe_isolation() const {
  constexpr auto kUsualDiscoveryTime = std::chrono::seconds(3);
  const auto* participant = impl_->participant;
  if (std::chrono::steady_clock::now() - impl_->joined < kUsualDiscoveryTime) return "";
  Environment environment = impl_->environment;
  environment.participants = participant->get_participant_names().size();  // the first is our own
  environment.is_alone = environment.participants <= 1;
  environment = look_around(environment);
  if (const std::string cause = find_cause(environment); !cause.empty()) return "; " + cause;
  if (!environment.is_alone) return "";
  const auto& builtin = participant->get_qos().wire_protocol().builtin;
  const auto name_hosts = [](const auto& locators) {
    std::string hosts;
    for (const auto& locator : locators) {
      const std::string host = rtps::IPLocator::toIPv4string(locator);
      if (hosts.find(host) == hosts.npos) hosts += (hosts.empty() ? "" : ", ") + host;
    }
    return hosts;
  };
  const auto servers = find_discovery_servers(participant->get_qos());
  if (!servers.empty())
    return "; the discovery server at " + name_hosts(servers) +
           " does not answer (SLS_DISCOVERY_SERVER; ./sls discovery-server starts one)";
  const std::string domain =
      "; no other program discovered on domain " + std::to_string(participant->get_domain_id());
  if (!builtin.initialPeersList.empty())
    return domain + " at " + name_hosts(builtin.initialPeersList) +
           ": is SLS_PEERS right? (./sls doctor)";
  const std::string elsewhere = bus::describe_other_flight(environment, true);
  return domain +
         (elsewhere.empty() ? ": another domain or QoS file"
                            : ", but " + elsewhere + ": is --domain right") +
         ", or is multicast blocked? try config/qos/unicast.xml, or ./sls doctor";
}

std::string Node::describe_other_flight() const {
  const std::string text = bus::describe_other_flight(look_around(impl_->environment));
  return text.empty() ? "" : "; " + text;
}

PeerId Node::id() const { return to_peer(impl_->participant->get_instance_handle()); }

Problems& Node::problems() const { return impl_->problems; }

void Node::note_problem(const PeerId& peer, const std::string& key, const std::string& text) const {
  impl_->neighbours.note_problem(peer, key, text);
}

void Node::end_problem(const PeerId& peer, const std::string& key) const {
  impl_->neighbours.end_problem(peer, key);
}

void Node::note_announced_name(const PeerId& peer, const std::string& name) const {
  impl_->neighbours.note_announced_name(peer, name);
}

std::map<PeerId, std::set<std::string>> Node::find_writers_of_servers() const {
  return impl_->neighbours.find_writers_of_servers();
}

std::string Node::describe(const PeerId& peer) const { return impl_->neighbours.describe(peer); }

std::set<PeerId> Node::find_misfits() const { return impl_->neighbours.find_misfits(); }

std::map<PeerId, std::string> Node::find_missing_deadlines() const {
  return impl_->neighbours.find_missing_deadlines();
}

namespace detail {

// A DataWriter with a deadline requires its own listener, so every writer has one
// (fastdds/README.md, trap 7).
struct AnyWriter::Impl : dds::DataWriterListener {
  void on_publication_matched(dds::DataWriter*,
                              const dds::PublicationMatchedStatus& status) override {
    peers.update(status.last_subscription_handle, status.current_count_change);
  }
  MatchedPeers peers;
  Node::Impl* node = nullptr;
  dds::DataWriter* writer = nullptr;
  std::optional<SharedDataLock> lock;
};

AnyWriter::AnyWriter(Node& node, const char* topic, const char* profile, void* type_support,
                     const std::string& user_data)
    : impl_(std::make_unique<Impl>()) {
  dds::TypeSupport type(static_cast<dds::TopicDataType*>(type_support));
  auto* dds_topic = node.impl().find_or_create_topic(topic, type);
  impl_->node = &node.impl();
  dds::DataWriterQos qos;
  if (!is_ok(impl_->node->publisher->get_datawriter_qos_from_profile(profile, qos)))
    node.impl().throw_unknown_profile(profile);
  if (!user_data.empty()) qos.user_data().data_vec({user_data.begin(), user_data.end()});
  const bool shares_data = impl_->node->choose_data_sharing(qos);
  MiddlewareLog::clear();
  impl_->writer = impl_->node->publisher->create_datawriter(dds_topic, qos, impl_.get());
  if (!impl_->writer) node.impl().throw_refused_endpoint("write", topic, profile);
  if (shares_data) impl_->lock.emplace(impl_->writer->guid());
  impl_->node->neighbours.add_own(make_facts(*impl_->writer));
}

AnyWriter::~AnyWriter() {
  if (!impl_->writer) return;
  impl_->node->neighbours.drop_own(make_facts(*impl_->writer));
  if (impl_->node->is_refused)
    static_cast<void>(impl_.release());  // the writer's listener
  else
    delete_writer(*impl_->node->publisher, impl_->writer);
}

bool AnyWriter::write(const void* sample) { return write_sample(*impl_->writer, sample); }

bool AnyWriter::wait_for_acknowledgments(std::chrono::milliseconds limit) {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limit);
  const auto rest = std::chrono::nanoseconds(limit - seconds);
  return is_ok(impl_->writer->wait_for_acknowledgments(
      {static_cast<std::int32_t>(seconds.count()), static_cast<std::uint32_t>(rest.count())}));
}

std::set<PeerId> AnyWriter::matched() const { return impl_->peers.peers(); }

int AnyWriter::history_depth() const {
  const dds::DataWriterQos& qos = impl_->writer->get_qos();
  if (qos.history().kind == dds::KEEP_LAST_HISTORY_QOS) return qos.history().depth;
  const int limit = qos.resource_limits().max_samples;
  return limit > 0 ? limit : std::numeric_limits<int>::max();
}

struct AnyReader::Impl : dds::DataReaderListener, MisfitReport {
  void on_data_available(dds::DataReader* source) override {
    dds::SampleInfo info;
    const MisfitScope scope(*this);
    const RawScope raw_scope(raw);
    while (is_ok(source->take_next_sample(sample, &info)))
      if (info.valid_data) {
        written = std::chrono::system_clock::time_point(
            std::chrono::nanoseconds(info.source_timestamp.to_ns()));
        take(to_peer(info.publication_handle));
      }
  }
  void on_subscription_matched(dds::DataReader*,
                               const dds::SubscriptionMatchedStatus& status) override {
    peers.update(status.last_publication_handle, status.current_count_change);
  }
  void on_requested_deadline_missed(dds::DataReader*,
                                    const dds::RequestedDeadlineMissedStatus& status) override {
    missed_deadlines = status.total_count;
  }
  void report(const rtps::SerializedPayload_t& payload, const std::string& type,
              const std::string& defect) override {
    const auto& guid = find_change(payload).writerGUID;
    Neighbours::EntityId writer;
    std::copy(std::begin(guid.entityId.value), std::end(guid.entityId.value), writer.begin());
    node->neighbours.note_misfit(to_peer(guid), writer, topic, type, defect);
  }
  MatchedPeers peers;
  Node::Impl* node = nullptr;
  std::string topic;
  std::atomic<std::uint64_t> missed_deadlines{0};
  std::optional<std::chrono::nanoseconds> lifespan;
  std::chrono::system_clock::time_point written;  // the sample in `sample`
  void* sample = nullptr;
  std::vector<std::uint8_t>* raw = nullptr;
  Take take;
  dds::DataReader* reader = nullptr;
  std::optional<SharedDataLock> lock;
};

AnyReader::AnyReader(Node& node, const char* topic, const char* profile, void* type_support,
                     void* sample, Take take, std::vector<std::uint8_t>* raw)
    : impl_(std::make_unique<Impl>()) {
  dds::TypeSupport type(static_cast<dds::TopicDataType*>(type_support));
  auto* dds_topic = node.impl().find_or_create_topic(topic, type);
  impl_->node = &node.impl();
  impl_->topic = topic;
  impl_->sample = sample;
  impl_->raw = raw;
  impl_->take = std::move(take);
  dds::DataReaderQos qos;
  if (!is_ok(impl_->node->subscriber->get_datareader_qos_from_profile(profile, qos)))
    node.impl().throw_unknown_profile(profile);
  const auto& lifespan = qos.lifespan().duration;
  const bool shares_data = impl_->node->choose_data_sharing(qos);
  if (!(lifespan == kInfinite)) impl_->lifespan = std::chrono::nanoseconds(lifespan.to_ns());
  MiddlewareLog::clear();
  impl_->reader = impl_->node->subscriber->create_datareader(dds_topic, qos, impl_.get());
  if (!impl_->reader) node.impl().throw_refused_endpoint("read", topic, profile);
  if (shares_data) impl_->lock.emplace(impl_->reader->guid());
  impl_->node->neighbours.add_own(make_facts(*impl_->reader));
}

AnyReader::~AnyReader() {
  if (!impl_->reader) return;
  impl_->node->neighbours.drop_own(make_facts(*impl_->reader));
  impl_->reader->set_listener(nullptr);
  if (!impl_->node->is_refused) impl_->node->subscriber->delete_datareader(impl_->reader);
}

std::set<PeerId> AnyReader::matched() const { return impl_->peers.peers(); }
std::uint64_t AnyReader::missed_deadlines() const { return impl_->missed_deadlines; }
std::optional<std::chrono::nanoseconds> AnyReader::lifespan() const { return impl_->lifespan; }
std::chrono::system_clock::time_point AnyReader::written() const { return impl_->written; }

void AnyReader::ignore_lifespan(bool is_ignored) {
  if (!impl_->lifespan) return;
  dds::DataReaderQos qos = impl_->reader->get_qos();
  qos.lifespan().duration =
      is_ignored ? kInfinite : Duration(std::chrono::duration<double>(*impl_->lifespan).count());
  impl_->reader->set_qos(qos);
}

}  // namespace detail

std::string middleware_version() { return kMiddlewareVersion; }

}  // namespace sls::bus
