// Two nodes on a domain of the test's own: one writes, the other reads. Profiles are global to a
// process: every test here uses the shipped default.
#include "common/bus/node.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <mutex>

#include "common/bus/fastdds/guarded_transports.hpp"
#include "common/config/config_error.hpp"
#include "fastcdr_api.hpp"
#include "fastdds_api.hpp"
#include "tests/common/bus/sample_messages.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/waiting.hpp"

namespace sls::bus {
namespace {

using sls::test::own_domain;
using sls::test::wait_until;
using test::make_message;

const std::filesystem::path kQosFile = SLS_SOURCE_DIR "/config/qos/default.xml";

/// A reader that keeps the messages of `sender`.
template <class Message>
class Listener {
 public:
  Listener(Node& node, const char* profile, const Node& sender)
      : sender_(sender.id()),
        reader_(node, profile, [this](const Message& message, const PeerId& from) {
          if (from != sender_) return;
          const std::lock_guard lock(mutex_);
          messages_.push_back(message);
        }) {}

  std::size_t count() const {
    const std::lock_guard lock(mutex_);
    return messages_.size();
  }
  std::vector<Message> messages() const {
    const std::lock_guard lock(mutex_);
    return messages_;
  }
  bool is_matched() const { return reader_.matched().count(sender_) > 0; }

 private:
  const PeerId sender_;
  mutable std::mutex mutex_;
  std::vector<Message> messages_;
  Reader<Message> reader_;
};

template <class Message>
bool is_matched(const Writer<Message>& writer, const Node& reader_node) {
  return writer.matched().count(reader_node.id()) > 0;
}

/// Writes messages in which every field is filled and reads them through each of `profiles`.
template <class Message>
void expect_round_trip(const std::vector<const char*>& profiles) {
  Node writing(kQosFile, own_domain(), "writing"), reading(kQosFile, own_domain(), "reading");
  EXPECT_NE(writing.id(), reading.id());
  Writer<Message> writer(writing);
  for (const char* profile : profiles) {
    SCOPED_TRACE(profile);
    // Until the reader before is forgotten, is_matched() would be true because of that one.
    ASSERT_TRUE(wait_until([&] { return !is_matched(writer, reading); }));
    Listener<Message> listener(reading, profile, writing);
    ASSERT_TRUE(wait_until([&] { return is_matched(writer, reading) && listener.is_matched(); }));
    const std::size_t earlier = listener.count();  // a late joiner may get earlier samples
    const std::vector<Message> sent = {make_message<Message>(1), Message(),
                                       make_message<Message>(2)};
    for (const Message& message : sent) writer.write(message);
    ASSERT_TRUE(wait_until([&] { return listener.count() >= earlier + sent.size(); }));
    const std::vector<Message> heard = listener.messages();
    EXPECT_EQ(
        std::vector<Message>(heard.end() - static_cast<std::ptrdiff_t>(sent.size()), heard.end()),
        sent);
    EXPECT_TRUE(writer.wait_for_acknowledgments(std::chrono::seconds(10)));
  }
}

TEST(NodeTest, StatesArriveUnchanged) { expect_round_trip<States>({kLoopReaderProfile}); }
TEST(NodeTest, CommandsArriveUnchanged) { expect_round_trip<Commands>({kLoopReaderProfile}); }
TEST(NodeTest, BatchesArriveUnchanged) {
  expect_round_trip<RecordBatch>({kRecordReaderProfile, kLoopReaderProfile});
}
TEST(NodeTest, ParticipantsArriveUnchanged) {
  expect_round_trip<Participant>({kLatchedReaderProfile});
}
TEST(NodeTest, ParametersArriveUnchanged) {
  expect_round_trip<Parameters>({kLatchedReaderProfile});
}
TEST(NodeTest, StatusesArriveUnchanged) { expect_round_trip<SimStatus>({kLatchedReaderProfile}); }

TEST(NodeTest, MatchesComeAndGoOnBothSides) {
  Node near(kQosFile, own_domain(), "near");
  Writer<States> writer(near);
  Reader<Commands> reader(near, kLoopReaderProfile, [](const auto&, const PeerId&) {});
  PeerId gone;
  {
    Node far(kQosFile, own_domain(), "far");
    gone = far.id();
    EXPECT_FALSE(is_matched(writer, far));
    Listener<States> far_listener(far, kLoopReaderProfile, near);
    Writer<Commands> far_writer(far);
    EXPECT_TRUE(wait_until([&] { return is_matched(writer, far); }));
    EXPECT_TRUE(wait_until([&] { return reader.matched().count(gone) > 0; }));
    {
      Listener<States> second(far, kLoopReaderProfile, near);
      EXPECT_TRUE(wait_until([&] { return second.is_matched(); }));
    }
    EXPECT_TRUE(is_matched(writer, far)) << "one of two readers has gone, not the participant";
  }
  EXPECT_TRUE(wait_until([&] { return writer.matched().count(gone) == 0; }));
  EXPECT_TRUE(wait_until([&] { return reader.matched().count(gone) == 0; }));
}

// --- raw samples ---------------------------------------------------------------------------------

/// `message` as Fast CDR serialises it, with the header of the encapsulation. Padding bytes, which
/// CDR leaves undefined, are `padding`.
template <class Message>
std::vector<std::uint8_t> serialize(const Message& message, std::uint8_t padding = 0) {
  std::vector<std::uint8_t> bytes(4'000'000, padding);
  eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(bytes.data()), bytes.size());
  Cdr cdr = make_cdr(buffer);
  cdr.serialize_encapsulation();
  write_message(message, cdr);
  bytes.resize(count_bytes(cdr));
  return bytes;
}

/// A serialised message that other bytes are compared with, whatever their padding is.
class Serialized {
 public:
  template <class Message>
  explicit Serialized(const Message& message)
      : zeros_(serialize(message, 0x00)), ones_(serialize(message, 0xff)) {}

  bool is_equal(const std::vector<std::uint8_t>& cdr) const {
    if (cdr.size() != zeros_.size()) return false;
    for (std::size_t i = 0; i < cdr.size(); ++i)
      if (zeros_[i] == ones_[i] && cdr[i] != zeros_[i]) return false;
    return true;
  }

 private:
  std::vector<std::uint8_t> zeros_, ones_;  // they differ in the padding
};

/// Like Listener, but keeps the serialised samples.
template <class Message>
class RawListener {
 public:
  RawListener(Node& node, const char* profile, const Node& sender)
      : sender_(sender.id()),
        reader_(node, profile, [this](std::vector<std::uint8_t>& cdr, const PeerId& from) {
          if (from != sender_) return;
          const std::lock_guard lock(mutex_);
          samples_.push_back(std::move(cdr));
        }) {}

  std::vector<std::vector<std::uint8_t>> samples() const {
    const std::lock_guard lock(mutex_);
    return samples_;
  }

 private:
  const PeerId sender_;
  mutable std::mutex mutex_;
  std::vector<std::vector<std::uint8_t>> samples_;
  RawReader<Message> reader_;
};

/// For each of `heard` the index of the equal one of `sent`; its size if there is none.
template <class Heard, class Sent, class Equal>
std::vector<std::size_t> find_each(const std::vector<Heard>& heard, const std::vector<Sent>& sent,
                                   const Equal& is_equal) {
  std::vector<std::size_t> indices;
  for (const Heard& sample : heard) {
    const auto found = std::find_if(sent.begin(), sent.end(),
                                    [&](const Sent& one) { return is_equal(one, sample); });
    indices.push_back(static_cast<std::size_t>(found - sent.begin()));
  }
  return indices;
}

/// The raw and the typed readers are on one node: they share its topic and its type support.
///
/// A writer knows the three readers one after the other and tells only that it knows one of their
/// node. A best-effort reader gets nothing before it is known, and a datagram may be lost. So the
/// messages are repeated until each reader has heard all of them.
template <class Message>
void expect_raw_beside_typed(const char* profile) {
  SCOPED_TRACE(Topic<Message>::kName);
  Node writing(kQosFile, own_domain(), "writing");
  Node reading(kQosFile, own_domain(), "reading", "", Transports::kNetwork);
  Writer<Message> writer(writing);
  RawListener<Message> raw(reading, profile, writing);
  Listener<Message> typed(reading, profile, writing);
  RawListener<Message> second(reading, profile, writing);
  const std::vector<Message> sent = {make_message<Message>(1), Message(), make_message<Message>(2)};
  const std::vector<Serialized> bytes(sent.begin(), sent.end());
  // One row per reader: what it has heard, as indices of `sent`.
  const auto heard = [&] {
    return std::vector<std::vector<std::size_t>>{
        find_each(raw.samples(), bytes, std::mem_fn(&Serialized::is_equal)),
        find_each(typed.messages(), sent, std::equal_to<Message>()),
        find_each(second.samples(), bytes, std::mem_fn(&Serialized::is_equal))};
  };
  const auto has_all = [&](const std::vector<std::size_t>& indices) {
    return std::set<std::size_t>(indices.begin(), indices.end()).size() >= sent.size();
  };
  const auto have_all = [&] {
    const auto rows = heard();
    return std::all_of(rows.begin(), rows.end(), has_all);
  };
  std::ptrdiff_t rounds = 0;
  EXPECT_TRUE(wait_until([&] {
    ++rounds;
    for (const Message& message : sent) writer.write(message);
    return wait_until(have_all, std::chrono::milliseconds(500));
  }));
  for (const auto& indices : heard()) {
    EXPECT_THAT(indices, testing::Each(testing::Lt(sent.size()))) << "unlike each sent message";
    for (std::size_t i = 0; i < sent.size(); ++i)
      EXPECT_THAT(std::count(indices.begin(), indices.end(), i),
                  testing::AllOf(testing::Ge(1), testing::Le(rounds)))
          << "message " << i;
  }
}

TEST(RawReaderTest, GivesTheBytesOfEachSampleBesideATypedReader) {
  expect_raw_beside_typed<States>(kLoopReaderProfile);
  expect_raw_beside_typed<RecordBatch>(kLoopReaderProfile);
  expect_raw_beside_typed<SimStatus>(kLatchedReaderProfile);
  expect_raw_beside_typed<Parameters>(kLatchedReaderProfile);
}

TEST(RawReaderTest, ItsBytesDecodeToTheSameMessage) {
  const auto states = make_message<States>(3);
  States decoded;
  ASSERT_TRUE(decode(serialize(states), decoded));
  EXPECT_EQ(decoded, states);
  const auto batch = make_message<RecordBatch>(4);
  RecordBatch decoded_batch;
  ASSERT_TRUE(decode(serialize(batch), decoded_batch));
  EXPECT_EQ(decoded_batch, batch);
}

TEST(RawReaderTest, BytesThatAreNoMessageAreNotDecoded) {
  auto bytes = serialize(make_message<States>(3));
  States decoded;
  for (const std::size_t size : {std::size_t{0}, std::size_t{3}, bytes.size() / 2}) {
    const std::vector<std::uint8_t> cut(bytes.begin(),
                                        bytes.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(decode(cut, decoded)) << size;
    EXPECT_EQ(decoded, States()) << size;
  }
  bytes.resize(bytes.size() + 100);
  EXPECT_FALSE(decode(bytes, decoded)) << "bytes left over";
}

// --- errors --------------------------------------------------------------------------------------

std::string find_error(const std::filesystem::path& file, int domain) {
  return sls::test::find_error<config::ConfigError>([&] { Node(file, domain, "test"); });
}

/// A file of shared memory port `port` in /dev/shm.
std::string name_port(std::uint32_t port) {
  return std::string("/dev/shm/") + kSharedMemoryPrefix + "port" + std::to_string(port);
}

TEST(NodeTest, NodesWithoutSharedMemoryJoinBesideThePortOfAKilledProcess) {
  const auto port = static_cast<std::uint32_t>(7410 + 250 * own_domain());
  const std::string stale = name_port(make_memory_port(port)) + "_el";
  std::ofstream(stale) << "";
  const Node first(kQosFile, own_domain(), "first", "", Transports::kNetwork);
  EXPECT_NO_THROW(Node(kQosFile, own_domain(), "second", "", Transports::kNetwork));
  std::filesystem::remove(stale);
}

// Participant ids are unique in a process, but ports are in use or stale per domain.
TEST(NodeTest, ANodeBesideThePortOfAKilledProcessSparesTheIdsOfItsProcess) {
  const sls::test::OwnDomain other;
  Node first(kQosFile, own_domain(), "first");
  const auto port = static_cast<std::uint32_t>(7410 + 250 * other.number() + 20);
  const std::string stale = name_port(make_memory_port(port)) + "_el";
  std::ofstream(stale) << "";
  EXPECT_NO_THROW(Node(kQosFile, other.number(), "second"));
  std::filesystem::remove(stale);
  Node third(kQosFile, own_domain(), "third");
  Writer<States> writer(third);
  Listener<States> listener(first, kLoopReaderProfile, third);
  EXPECT_TRUE(wait_until([&] { return listener.is_matched(); }));
}

TEST(NodeTest, PortsOfAnotherBuildAndUnfinishedOnesAreNotOpened) {
  const sls::test::OwnDomain domain;
  const auto first = static_cast<std::uint32_t>(7410 + 250 * domain.number());
  std::string other_layout(60'000, '\x5a');
  other_layout.replace(0, 4, std::string("\2\0\0\0", 4));  // it says that it is finished
  std::vector<std::string> files;
  for (std::uint32_t port = first - 10; port < first + 4; ++port) {
    files.push_back(name_port(port));
    std::ofstream(files.back()) << other_layout;
    if (port < first) continue;
    files.push_back(name_port(make_memory_port(port)));
    std::ofstream(files.back()) << (port % 2 == 0 ? std::string(60'000, '\0') : "");
  }
  {
    Node near(kQosFile, domain.number(), "near"), far(kQosFile, domain.number(), "far");
    Writer<States> writer(near);
    Listener<States> listener(far, kLoopReaderProfile, near);
    EXPECT_TRUE(wait_until([&] { return is_matched(writer, far) && listener.is_matched(); }));
    writer.write(make_message<States>(1));
    EXPECT_TRUE(wait_until([&] { return listener.count() == 1; }));
  }
  for (const std::string& file : files) std::filesystem::remove(file);
}

TEST(NodeTest, ADatagramThatTheMiddlewareAssertsAboutDisturbsNothing) {
  const sls::test::OwnDomain domain;
  Node near(kQosFile, domain.number(), "near"), far(kQosFile, domain.number(), "far");
  std::string datagram(
      "RTPS\2\3\1\17"
      "another host");
  const std::string statistics = std::string("\x80\1\x38\0", 4) + std::string(56, '\0');
  datagram += statistics + std::string("\1\1\0\0", 4);
  const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
  for (const int port : {0, 10, 11, 12, 13})
    for (const char* address : {"127.0.0.1", "239.255.0.1"}) {
      sockaddr_in to{};
      to.sin_family = AF_INET;
      to.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * domain.number() + port));
      ::inet_pton(AF_INET, address, &to.sin_addr);
      ::sendto(socket, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&to),
               sizeof to);
    }
  ::close(socket);
  Writer<States> writer(near);
  Listener<States> listener(far, kLoopReaderProfile, near);
  EXPECT_TRUE(wait_until([&] { return is_matched(writer, far) && listener.is_matched(); }));
}

TEST(NodeErrorTest, ADomainOutOfRangeIsRefusedWithItsRange) {
  for (const int domain : {-1, 233, 100000, -2147483647 - 1}) {
    const std::string error = find_error(kQosFile, domain);
    EXPECT_EQ(error, "--domain: expected 0 to 232, got " + std::to_string(domain));
  }
}

// Profiles are global to a process: a second file would have no effect, without an error.
TEST(NodeErrorTest, ASecondQosFileInOneProcessIsRefused) {
  const sls::test::TemporaryFolder folder;
  std::filesystem::copy_file(kQosFile, folder / "other.xml");
  Node first(kQosFile, own_domain(), "first");
  EXPECT_EQ(find_error(kQosFile, own_domain()), "no error");
  EXPECT_NE(find_error(folder / "other.xml", own_domain()), "no error");
}

TEST(NodeTest, TheMiddlewaresVersionIsAVersion) {
  EXPECT_EQ(middleware_version().find_first_not_of("0123456789."), std::string::npos);
  EXPECT_EQ(middleware_version().rfind(std::to_string(kFastDdsMajor) + ".", 0), 0u);
}

}  // namespace
}  // namespace sls::bus
