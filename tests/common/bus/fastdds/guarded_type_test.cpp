#include "common/bus/fastdds/guarded_type.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace sls::bus {
namespace {

template <class Type, class Message>
bool takes(const std::string& bytes, Message& message) {
  rtps::SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  GuardedType<Type> type;
  return deserialize(type, payload, &message);
}

template <class Type>
bool takes(const std::string& bytes) {
  typename Type::type message;
  return takes<Type>(bytes, message);
}

template <class... Types>
bool do_any_take(const std::string& bytes) {
  return (takes<Types>(bytes) || ...);
}
constexpr auto kIsTaken =
    &do_any_take<StatesPubSubType, CommandsPubSubType, RecordBatchPubSubType, ParametersPubSubType,
                 ParticipantPubSubType, SimStatusPubSubType, SimControlPubSubType,
                 SimControlReplyPubSubType>;

// Found by tests/fuzz: the generated code throws an exception in the thread of the middleware.
TEST(GuardedTypeTest, ASampleOfWrongEncapsulationIsRefused) {
  EXPECT_FALSE(kIsTaken(std::string(200, 'x')));
}

TEST(GuardedTypeTest, EndlessLengthsAreRefused) {
  for (const char* encapsulation : {"\0\1\0\0", "\0\0\0\0"})
    EXPECT_FALSE(kIsTaken(std::string(encapsulation, 4) + std::string(600, '\xff')));
}

TEST(GuardedTypeTest, SamplesThatEndBetweenTwoMembersAreRefused) {
  const std::string bytes = std::string("\0\1\0\0", 4) + std::string(21, '\0');
  for (std::size_t size = 0; size < 25; ++size)
    EXPECT_FALSE(kIsTaken(bytes.substr(0, size))) << size;
}

/// A sample of `size` bytes that gives a sequence length of `count` after `before`.
std::string make_claim(const std::string& before, std::uint32_t count, std::size_t size) {
  std::string bytes = std::string("\0\1\0\0", 4) + before;
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(count >> shift & 0xff);
  bytes.resize(size);
  return bytes;
}

const std::string kBeforeVehicles(24, '\0');                 // run_id, step, sim_time_ns
const std::string kBeforeCommands = std::string(16, '\0') +  // run_id, step
                                    std::string("\1\0\0\0\0\0\0\0\0\0\0\0", 12);  // name, strength
const std::string kBeforeEntries(20, '\0');  // run_id, batch_index, is_last

TEST(GuardedTypeTest, AnOversizedSampleIsRefusedBeforeItsElementsAreMade) {
  constexpr std::uint32_t kCount = 1'000'000;  // of half a kilobyte each
  constexpr std::size_t kSize = 2'000'000;
  EXPECT_FALSE(takes<StatesPubSubType>(make_claim(kBeforeVehicles, kCount, kSize)));
  EXPECT_FALSE(takes<CommandsPubSubType>(make_claim(kBeforeCommands, kCount, kSize)));
  EXPECT_FALSE(takes<RecordBatchPubSubType>(make_claim(kBeforeEntries, kCount, kSize)));
}

/// Expects that a sample of the greatest size with a far too large sequence length is refused, and
/// that the message keeps no memory for the elements.
template <class Type, class Message, class Elements>
void expect_nothing_kept(const std::string& before, Elements elements) {
  const auto size = max_size_of(Type());
  for (const std::uint32_t count : {0xffffffffU, 0x7fffffffU, size - 1000}) {
    Message message;
    EXPECT_FALSE(takes<Type>(make_claim(before, count, size), message)) << count;
    EXPECT_EQ((message.*elements)().capacity(), 0u) << count;
  }
}

TEST(GuardedTypeTest, ClaimedElementsThatDoNotFollowAreNotKept) {
  using VehicleStates = std::vector<VehicleState>& (States::*)();
  using VehicleCommands = std::vector<ControlCommand>& (Commands::*)();
  using Entries = std::vector<RecordEntry>& (RecordBatch::*)();
  expect_nothing_kept<StatesPubSubType, States, VehicleStates>(kBeforeVehicles, &States::vehicles);
  expect_nothing_kept<CommandsPubSubType, Commands, VehicleCommands>(kBeforeCommands,
                                                                     &Commands::vehicles);
  expect_nothing_kept<RecordBatchPubSubType, RecordBatch, Entries>(kBeforeEntries,
                                                                   &RecordBatch::entries);
  // One entry with a far too large number of measured states.
  std::string entry = make_claim(kBeforeEntries, 1, 28).substr(4);
  entry += std::string(24 + 23 * 8 + 4, '\0');  // vehicle_id, step, kind; truth without signals
  expect_nothing_kept<RecordBatchPubSubType, RecordBatch, Entries>(entry, &RecordBatch::entries);
}

/// Keeps the report on a sample that a reader cannot take.
class Report : public MisfitReport {
 public:
  void report(const rtps::SerializedPayload_t&, const std::string& type,
              const std::string& defect) override {
    text = type + ": " + defect;
  }
  std::string text;
};

std::string serialize(const Commands& message) {
  CommandsPubSubType type;
  rtps::SerializedPayload_t payload;
  EXPECT_TRUE(bus::serialize(type, &message, payload));
  return {reinterpret_cast<const char*>(payload.data), payload.length};
}

TEST(GuardedTypeTest, ASampleWithAFieldMoreOrLessIsRefusedAndReported) {
  Commands sent, received;
  sent.client_name("foo");
  sent.vehicles().resize(2);
  const std::string bytes = serialize(sent);
  const std::string size = std::to_string(bytes.size());
  Report report;
  const MisfitScope scope(report);
  EXPECT_TRUE(takes<CommandsPubSubType>(bytes, received));
  EXPECT_EQ(received, sent);
  for (int padding = 1; padding <= 3; ++padding)  // other vendors pad to a multiple of four
    EXPECT_TRUE(takes<CommandsPubSubType>(bytes + std::string(padding, '\0'), received));
  EXPECT_EQ(report.text, "");

  for (const std::size_t more : {4, 8, 400}) {
    EXPECT_FALSE(takes<CommandsPubSubType>(bytes + std::string(more, '\0'), received));
    EXPECT_EQ(report.text, "sls::Commands: expected " + size + " bytes, got " +
                               std::to_string(bytes.size() + more));
  }
  for (const std::size_t less : {1, 4, 8, 400}) {
    EXPECT_FALSE(takes<CommandsPubSubType>(bytes.substr(0, bytes.size() - less), received));
    EXPECT_EQ(report.text,
              "sls::Commands: expected more bytes, got " + std::to_string(bytes.size() - less));
  }
  const auto type_size = max_size_of(CommandsPubSubType());
  EXPECT_FALSE(takes<CommandsPubSubType>(std::string(type_size + 1, '\0'), received));
  EXPECT_EQ(report.text, "sls::Commands: expected at most " + std::to_string(type_size) +
                             " bytes, got " + std::to_string(type_size + 1));
  EXPECT_FALSE(takes<CommandsPubSubType>("\x09" + bytes, received));  // no plain CDR
  EXPECT_EQ(report.text.find("sls::Commands: expected plain CDR of that type, got: "), 0u);
}

/// True if `message` is taken after it is serialised. The payload has the size that the message
/// needs, also for sequences longer than the contract allows.
template <class Type, class Message>
bool is_taken_back(Message message) {
  rtps::SerializedPayload_t payload;
  Type writing;
  EXPECT_TRUE(bus::serialize(writing, &message, payload));
  Message back;
  GuardedType<Type> reading;
  return deserialize(reading, payload, &back);
}

TEST(GuardedTypeTest, SequencesBeyondTheirBoundsAreRefused) {
  Commands commands;
  commands.vehicles().resize(SAMPLE_VEHICLES);
  commands.vehicles().back().controller().numbers().resize(MOST_NUMBERS);
  EXPECT_TRUE(is_taken_back<CommandsPubSubType>(commands));
  commands.vehicles().back().controller().numbers().resize(MOST_NUMBERS + 1);
  EXPECT_FALSE(is_taken_back<CommandsPubSubType>(commands));
  States states;
  states.vehicles().resize(SAMPLE_VEHICLES + 1);
  EXPECT_FALSE(is_taken_back<StatesPubSubType>(states));
  RecordBatch batch;
  batch.entries().resize(1);
  batch.entries().front().measured().resize(1);
  EXPECT_TRUE(is_taken_back<RecordBatchPubSubType>(batch));
  batch.entries().front().measured().resize(2);
  EXPECT_FALSE(is_taken_back<RecordBatchPubSubType>(batch));
  batch.entries().resize(BATCH_ENTRIES + 1);
  EXPECT_FALSE(is_taken_back<RecordBatchPubSubType>(batch));
}

/// `bytes` with `name` instead of the one-letter name at `at`, its length before it, and the
/// padding of four bytes after it.
std::string rename(std::string bytes, std::size_t at, const std::string& name) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8)
    text += static_cast<char>((name.size() + 1) >> shift & 0xff);
  text += name;
  text.resize((text.size() + 4) / 4 * 4, '\0');
  return bytes.replace(at - 4, 8, text);
}

TEST(GuardedTypeTest, NamesBeyondTheirBoundsAreRefusedAndReported) {
  Commands sent, received;
  sent.client_name("c");
  sent.vehicles().resize(1);
  sent.vehicles()[0].reference().stage_name("s");
  const std::string bytes = serialize(sent);
  Report report;
  const MisfitScope scope(report);
  for (const auto& [letter, field] :
       {std::pair("c", "client_name"), std::pair("s", "reference.stage_name")}) {
    SCOPED_TRACE(field);
    const std::string pattern = std::string("\2\0\0\0", 4) + letter;
    const std::size_t at = bytes.find(pattern) + 4;
    report.text.clear();
    EXPECT_TRUE(takes<CommandsPubSubType>(rename(bytes, at, std::string(32, 'x')), received));
    for (const std::size_t length : {33, 35, 40, 56}) {
      EXPECT_EQ(report.text, "");
      EXPECT_FALSE(
          takes<CommandsPubSubType>(rename(bytes, at, std::string(length, 'x')), received));
      EXPECT_EQ(std::exchange(report.text, ""),
                std::string("sls::Commands: expected at most 32 bytes in ") + field + ", got more");
    }
  }
}

TEST(GuardedTypeTest, RandomBytesThrowNothing) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 20000; ++i) {
    std::string bytes(random() % 800, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    if (bytes.size() >= 4 && i % 2) std::copy_n("\0\1\0\0", 4, bytes.begin());
    EXPECT_NO_THROW((takes<ParametersPubSubType>(bytes)));
    EXPECT_NO_THROW((takes<ParticipantPubSubType>(bytes)));
    EXPECT_NO_THROW((takes<SimControlPubSubType>(bytes)));
  }
}

}  // namespace
}  // namespace sls::bus
