/// The only door to Fast DDS: one domain participant configured by a QoS file, typed writers and
/// readers on it. Nothing of Fast DDS shows through these headers. Traps it avoids:
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

/// The middleware refused or broke something while running (exit code 1).
class BusError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Makes the middleware ready and loads a QoS file into it: one for the whole process, because
/// profiles are global there. A Node calls it; call it yourself only to make a participant
/// without a Node (tools/doctor/observer.cpp).
/// @throws config::ConfigError as Node does.
void load_profiles(const std::filesystem::path& file, const std::string& identity);

/// Which transports of its profile a participant uses.
enum class Transports {
  kAll,
  /// All but shared memory, whose ports have locks that a process which is stopped or starved may
  /// hold: an onlooker on the network alone can make nobody wait.
  kNetwork
};

/// One DDS participant. Writers and readers must not outlive it.
class Node {
 public:
  /// Joins `domain` (0–232) with the profiles of `qos_file`; `name` shows in discovery, `identity`
  /// is whose keys a secured domain sees (server, controller, recorder or operator).
  /// @throws config::ConfigError naming the file, and the line where known, if it cannot be read,
  ///   is malformed, lacks a profile, or holds what Fast DDS refuses; or if it is not the one file
  ///   that this process uses; or for the domain.
  /// @throws BusError if the participant cannot be created.
  Node(const std::filesystem::path& qos_file, int domain, const std::string& name,
       const std::string& identity = {}, Transports transports = Transports::kAll);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  PeerId id() const;

  /// `profile` if the QoS file has one of that name, else `fallback`.
  const char* choose_writer_profile(const char* profile, const char* fallback) const;
  const char* choose_reader_profile(const char* profile, const char* fallback) const;

  /// Largest size of a sample of the loop that is made of many parts, so that it fits into one
  /// datagram, so that one lost packet does not lose the parts that came in others. The QoS file
  /// says how long a datagram may be (property sls.max_datagram_bytes of the participant).
  std::size_t max_sample_bytes() const;

  /// The same of a batch of sls/record: 12,000 bytes, which go in fragments that are repaired one
  /// by one, so that a full history takes 64 MB at most; one datagram where DDS Security leaves
  /// none.
  std::size_t max_batch_bytes() const;

  /// "; " and hints, if no other program has been discovered 3 s after joining,
  /// to be appended to a message about who is missing. Else empty.
  std::string describe_isolation() const;

  /// Mistakes of the other programs on the domain. Endpoints and samples that do not match ours are
  /// added automatically.
  Problems& problems() const;

  /// A mistake of a participant until it leaves: `text` is logged behind its description, once for
  /// each `key`.
  void note_problem(const PeerId& peer, const std::string& key, const std::string& text) const;

  /// 'foo' (10.0.0.2): what a participant says of itself in discovery.
  std::string describe(const PeerId& peer) const;

  /// Participants whose sls/command offers a longer DEADLINE than ours asks, in words: a mistake of
  /// those who fly for us (fastdds/neighbours.hpp).
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
  /// `user_data`: what discovery shows of the writer (policy USER_DATA).
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
  /// `sample` is the buffer every sample is taken into; `take` is called after each, on a thread of
  /// the middleware.
  /// With `raw`, samples are put there as they came, and `sample` stays as it is.
  AnyReader(Node& node, const char* topic, const char* profile, void* type_support, void* sample,
            Take take, std::vector<std::uint8_t>* raw = nullptr);
  ~AnyReader();
  std::set<PeerId> matched() const;
  std::uint64_t missed_deadlines() const;
  std::optional<std::chrono::nanoseconds> lifespan() const;
  void ignore_lifespan();
  std::chrono::system_clock::time_point written() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace detail

template <class Message>
class Writer {
 public:
  /// With the profile of the topic's flow, or `profile`.
  explicit Writer(Node& node, const char* profile = find_writer_profile(Topic<Message>::kFlow))
      : writer_(node, Topic<Message>::kName, profile, detail::make_type_support<Message>()) {}

  /// Hands `message` to the middleware; may block while a history is full, so it has no place in a
  /// reader's handler (fastdds/README.md, trap 4).
  /// @throws BusError if it was not taken: the history stayed full for `max_blocking_time`.
  void write(const Message& message) {
    if (!writer_.write(&message))
      throw BusError(std::string(Topic<Message>::kName) +
                     ": write refused: a reliable reader has not acknowledged for too long");
  }

  /// Waits until every reliable reader has everything, at most `limit`; false if it ran out.
  bool wait_for_acknowledgments(std::chrono::milliseconds limit) {
    return writer_.wait_for_acknowledgments(limit);
  }

  /// Participants with a reader of this topic that this writer serves.
  std::set<PeerId> matched() const { return writer_.matched(); }

  /// How many samples are kept for readers that are late.
  int history_depth() const { return writer_.history_depth(); }

 private:
  detail::AnyWriter writer_;
};

/// Calls `handler(message, sender)` for every sample, on a thread of the middleware: the handler
/// must be short and must not write.
template <class Message>
class Reader {
 public:
  /// May take over what `message` holds: the next sample finds other memory.
  using Handler = std::function<void(Message& message, const PeerId& sender)>;

  Reader(Node& node, const char* profile, Handler handler)
      : handler_(std::move(handler)),
        reader_(node, Topic<Message>::kName, profile, detail::make_type_support<Message>(),
                buffer_.get(), [this](const PeerId& sender) { handler_(*buffer_, sender); }) {}

  /// Participants with a writer of this topic that this reader hears.
  std::set<PeerId> matched() const { return reader_.matched(); }

  /// Times no sample came for the DEADLINE of the reader's profile.
  std::uint64_t missed_deadlines() const { return reader_.missed_deadlines(); }

  /// LIFESPAN of the reader's profile; nothing if it is infinite.
  std::optional<std::chrono::nanoseconds> lifespan() const { return reader_.lifespan(); }

  /// From now on no sample expires. `lifespan()` stays what the profile says.
  void ignore_lifespan() { reader_.ignore_lifespan(); }

  /// For the handler: when the sample it was given was written, by the writer's clock.
  std::chrono::system_clock::time_point written() const { return reader_.written(); }

 private:
  std::unique_ptr<Message> buffer_ = std::make_unique<Message>();
  Handler handler_;
  detail::AnyReader reader_;  // last: its callbacks use the members above
};

/// Like Reader, for samples as they came: plain CDR with its encapsulation header, not decoded and
/// checked for nothing but their size.
template <class Message>
class RawReader {
 public:
  /// May take over the bytes: the next sample finds other memory.
  using Handler = std::function<void(std::vector<std::uint8_t>& cdr, const PeerId& sender)>;

  RawReader(Node& node, const char* profile, Handler handler)
      : handler_(std::move(handler)),
        reader_(
            node, Topic<Message>::kName, profile, detail::make_type_support<Message>(),
            unused_.get(), [this](const PeerId& sender) { handler_(cdr_, sender); }, &cdr_) {}

  /// Participants with a writer of this topic that this reader hears.
  std::set<PeerId> matched() const { return reader_.matched(); }

  /// For the handler: when the sample it was given was written, by the writer's clock.
  std::chrono::system_clock::time_point written() const { return reader_.written(); }

 private:
  std::unique_ptr<Message> unused_ = std::make_unique<Message>();
  std::vector<std::uint8_t> cdr_;
  Handler handler_;
  detail::AnyReader reader_;  // last: its callbacks use the members above
};

/// Decodes what a RawReader was given. False, and `message` empty, where it is no such message.
template <class Message>
bool decode(const std::vector<std::uint8_t>& cdr, Message& message);

/// "2.9.1": the version of Fast DDS this was built with.
std::string middleware_version();

}  // namespace sls::bus
