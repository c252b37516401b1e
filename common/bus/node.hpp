/// The only interface to Fast DDS: one domain participant configured by a QoS file, with typed
/// writers and readers. This header uses no type of Fast DDS. Traps that it avoids:
/// fastdds/README.md.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/peer.hpp"
#include "common/bus/problems.hpp"
#include "common/bus/topics.hpp"

namespace sls::bus {

/// The middleware refused a call or failed during the run (exit code 1).
class BusError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Initialises the middleware and loads a QoS file into it. A process uses one file, because
/// profiles are global in the middleware. Node calls this function; other code calls it only to
/// create a participant without a Node (tools/doctor/observer.cpp).
/// @throws config::ConfigError as Node does.
void load_profiles(const std::filesystem::path& file, const std::string& identity);

/// Which transports of its profile a participant uses.
enum class Transports {
  kAll,
  /// All, with the whole queue of the profile for what arrives over shared memory. Only a recorder
  /// has such bursts; otherwise the queue is short (fastdds/transports.hpp).
  kAllWithLongQueue,
  /// All except shared memory. A stopped or starved process may hold the lock of a shared-memory
  /// port; a viewer that uses only the network cannot block other programs.
  kNetwork
};

/// One DDS participant. Writers and readers must not outlive it.
class Node {
 public:
  /// Joins `domain` (0–232) with the profiles of `qos_file`. Discovery shows `name`. `identity`
  /// selects the keys for a secured domain (server, controller, recorder or operator).
  /// @throws config::ConfigError if the file cannot be read, is malformed, lacks a profile, has
  ///   content that Fast DDS refuses, or is not the one that this process already uses. The message
  ///   names the file and, if known, the line. Also thrown for a wrong domain.
  /// @throws BusError if the participant cannot be created, or could not work on this machine.
  Node(const std::filesystem::path& qos_file, int domain, const std::string& name,
       const std::string& identity = {}, Transports transports = Transports::kAll);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  PeerId id() const;

  /// `profile` if the QoS file has one of that name, else `fallback`.
  const char* choose_writer_profile(const char* profile, const char* fallback) const;
  const char* choose_reader_profile(const char* profile, const char* fallback) const;

  /// Largest size of a loop sample, which has many parts: it must fit into one datagram, because
  /// one lost fragment would lose all its parts. The QoS file limits the length of a datagram
  /// (property sls.max_datagram_bytes of the participant).
  std::size_t max_sample_bytes() const;

  /// The same for a batch of sls/record: 12,000 bytes, which limits a full history to 64 MB. A
  /// batch is sent in fragments, which are repaired one by one; with DDS Security it is at most one
  /// datagram, because datagrams are larger there.
  std::size_t max_batch_bytes() const;

  /// "; " and the cause, to be appended to a message about a missing participant, from 3 s after
  /// joining: what this machine tells (environment.hpp); without that a guess if no other program
  /// has been discovered; else empty.
  std::string describe_isolation() const;

  /// "; " and the server that runs on this domain and machine, with a free domain; else empty.
  std::string describe_other_flight() const;

  /// True if the QoS file restricts this node to its own machine: shared memory, and UDP on
  /// loopback addresses alone. Other programs then discover it within milliseconds, and no packet
  /// is lost.
  bool stays_on_this_machine() const;

  /// True if each participant that has a discovery port of this domain open on this machine
  /// (network namespace) has been discovered. It takes a system call or two.
  bool has_discovered_this_machine() const;

  /// Discovered participants with this name.
  std::set<PeerId> find_named(const std::string& name) const;

  /// Mistakes of the other programs on the domain. Endpoints and samples that do not match ours are
  /// added automatically.
  Problems& problems() const;

  /// Adds a mistake that lasts until the participant leaves. `text` is logged after the
  /// participant's description, once for each `key`.
  void note_problem(const PeerId& peer, const std::string& key, const std::string& text) const;

  void end_problem(const PeerId& peer, const std::string& key) const;

  /// 'foo' (10.0.0.2): name and address that a participant announces in discovery. The name of
  /// `note_announced_name` replaces that of discovery.
  std::string describe(const PeerId& peer) const;

  /// The participant calls itself `name` in sls/participant: see Neighbours.
  void note_announced_name(const PeerId& peer, const std::string& name) const;

  /// Participants with a writer of sls/state, sls/status or sls/record, which only servers have;
  /// with the names of these topics.
  std::map<PeerId, std::set<std::string>> find_writers_of_servers() const;

  /// Participants whose sls/command offers a longer DEADLINE than our reader requests, or none,
  /// with a text: a mistake if the participant serves our run (fastdds/neighbours.hpp).
  std::map<PeerId, std::string> find_missing_deadlines() const;

  /// Participants that `problems` names for their endpoints or samples.
  std::set<PeerId> find_misfits() const;

  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

namespace detail {

/// The generated type support of `Message` (type_support.cpp), to be handed to a writer or reader.
template <class Message>
void* make_type_support();

// AnyWriter and AnyReader are the type-erased halves of Writer and Reader.

class AnyWriter {
 public:
  /// `user_data`: the policy USER_DATA, which discovery announces.
  AnyWriter(Node& node, const char* topic, const char* profile, void* type_support,
            const std::string& user_data = {});
  ~AnyWriter();
  bool write(const void* sample);
  bool wait_for_acknowledgments(std::chrono::milliseconds limit);
  std::set<PeerId> matched() const;
  int history_depth() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

class AnyReader {
 public:
  using Take = std::function<void(const PeerId& sender)>;
  /// Takes every sample into the buffer `sample` and then calls `take`, on a thread of the
  /// middleware. With `raw`, the undecoded bytes go there and `sample` does not change.
  AnyReader(Node& node, const char* topic, const char* profile, void* type_support, void* sample,
            Take take, std::vector<std::uint8_t>* raw = nullptr);
  ~AnyReader();
  std::set<PeerId> matched() const;
  std::uint64_t missed_deadlines() const;
  std::optional<std::chrono::nanoseconds> lifespan() const;
  void ignore_lifespan(bool is_ignored);
  std::chrono::system_clock::time_point written() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace detail

template <class Message>
class Writer {
 public:
  /// `profile`: by default that of the topic's flow.
  explicit Writer(Node& node, const char* profile = find_writer_profile(Topic<Message>::kFlow))
      : writer_(node, Topic<Message>::kName, profile, detail::make_type_support<Message>()) {}

  /// Passes `message` to the middleware. It may block while a history is full, so a reader's
  /// handler must not call it (fastdds/README.md, trap 4).
  /// @throws BusError if it was not taken: the history stayed full for `max_blocking_time`.
  void write(const Message& message) {
    if (!writer_.write(&message))
      throw BusError(std::string(Topic<Message>::kName) +
                     ": write refused: a reliable reader has not acknowledged for too long");
  }

  /// Waits until every reliable reader has acknowledged all samples; false after `limit`.
  bool wait_for_acknowledgments(std::chrono::milliseconds limit) {
    return writer_.wait_for_acknowledgments(limit);
  }

  /// Participants with a reader that is matched with this writer.
  std::set<PeerId> matched() const { return writer_.matched(); }

  /// Number of samples that are kept for late readers.
  int history_depth() const { return writer_.history_depth(); }

 private:
  detail::AnyWriter writer_;
};

/// Calls `handler(message, sender)` for every sample, on a thread of the middleware: the handler
/// must be short. It may write only to a keep-last stream: fastdds/README.md, trap 4.
template <class Message>
class Reader {
 public:
  /// A handler may move the content of `message` away: the next sample replaces it.
  using Handler = std::function<void(Message& message, const PeerId& sender)>;

  Reader(Node& node, const char* profile, Handler handler)
      : handler_(std::move(handler)),
        reader_(node, Topic<Message>::kName, profile, detail::make_type_support<Message>(),
                buffer_.get(), [this](const PeerId& sender) { handler_(*buffer_, sender); }) {}

  /// Participants with a writer that is matched with this reader.
  std::set<PeerId> matched() const { return reader_.matched(); }

  /// Number of times that no sample came within the DEADLINE of the reader's profile.
  std::uint64_t missed_deadlines() const { return reader_.missed_deadlines(); }

  /// LIFESPAN of the reader's profile; nothing if it is infinite.
  std::optional<std::chrono::nanoseconds> lifespan() const { return reader_.lifespan(); }

  /// From now on no sample expires, or samples expire again. `lifespan()` stays what the profile
  /// says.
  void ignore_lifespan(bool is_ignored) { reader_.ignore_lifespan(is_ignored); }

  /// For the handler: the time at which its sample was written, by the writer's clock.
  std::chrono::system_clock::time_point written() const { return reader_.written(); }

 private:
  std::unique_ptr<Message> buffer_ = std::make_unique<Message>();
  Handler handler_;
  detail::AnyReader reader_;  // last: its callbacks use the members above
};

/// Like Reader, with undecoded samples: plain CDR with its encapsulation header. Only their size is
/// checked.
template <class Message>
class RawReader {
 public:
  /// A handler may move the bytes away: the next sample replaces them.
  using Handler = std::function<void(std::vector<std::uint8_t>& cdr, const PeerId& sender)>;

  RawReader(Node& node, const char* profile, Handler handler)
      : handler_(std::move(handler)),
        reader_(
            node, Topic<Message>::kName, profile, detail::make_type_support<Message>(),
            unused_.get(), [this](const PeerId& sender) { handler_(cdr_, sender); }, &cdr_) {}

  /// Participants with a writer that is matched with this reader.
  std::set<PeerId> matched() const { return reader_.matched(); }

  /// For the handler: the time at which its sample was written, by the writer's clock.
  std::chrono::system_clock::time_point written() const { return reader_.written(); }

 private:
  std::unique_ptr<Message> unused_ = std::make_unique<Message>();
  std::vector<std::uint8_t> cdr_;
  Handler handler_;
  detail::AnyReader reader_;  // last: its callbacks use the members above
};

/// Decodes a sample of a RawReader. False, with an empty `message`, if it is malformed.
template <class Message>
bool decode(const std::vector<std::uint8_t>& cdr, Message& message);

/// "2.9.1": the version of Fast DDS this was built with.
std::string middleware_version();

}  // namespace sls::bus
