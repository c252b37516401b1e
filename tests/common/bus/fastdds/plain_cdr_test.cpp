// Judged by the generated code.
#include "common/bus/fastdds/plain_cdr.hpp"

#include <gtest/gtest.h>
#include <slsPubSubTypes.h>

#include <algorithm>
#include <optional>
#include <string>

#include "fastcdr_api.hpp"
#include "fastdds_types.hpp"
#include "tests/common/bus/sample_messages.hpp"

namespace sls::bus {
namespace {

using test::make_message;

std::string to_text(const rtps::SerializedPayload_t& payload) {
  return {reinterpret_cast<const char*>(payload.data), payload.length};
}

template <class Type>
std::string write_generated(const typename Type::type& message) {
  Type type;
  rtps::SerializedPayload_t payload(2 * max_size_of(type));
  std::fill_n(payload.data, payload.max_size, std::uint8_t{0});  // it does not write padding
  EXPECT_TRUE(bus::serialize(type, &message, payload));
  return to_text(payload);
}

template <class Message>
std::string write_plain(const Message& message) {
  rtps::SerializedPayload_t payload(plain_cdr::calc_size(message));
  std::fill_n(payload.data, payload.max_size, std::uint8_t{0xff});
  EXPECT_TRUE(plain_cdr::write(message, payload));
  EXPECT_EQ(payload.length, payload.max_size);
  return to_text(payload);
}

template <class Message>
std::optional<Message> read_plain(const std::string& bytes, Message message = {}) {
  rtps::SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = payload.max_size;
  return plain_cdr::read(payload, message, 0) ? std::optional(message) : std::nullopt;
}

/// Reads with Fast CDR, without the generated type support, which catches only some exceptions.
template <class Message>
Message read_generated(std::string bytes) {
  eprosima::fastcdr::FastBuffer buffer(bytes.data(), bytes.size());
  Cdr cdr = make_cdr(buffer);
  Message message;
  try {
    cdr.read_encapsulation();
    read_message(cdr, message);
  } catch (const eprosima::fastcdr::exception::Exception& error) {
    ADD_FAILURE() << error.what();
  }
  return message;
}

/// Empty, filled, and with sequences and names of each length that changes the padding.
template <class Message>
std::vector<Message> make_messages();

template <>
std::vector<States> make_messages() {
  std::vector<States> all = {{}, make_message<States>(1), make_message<States>(2)};
  for (std::size_t count = 0; count < 9; ++count) {
    VehicleState vehicle = make_message<States>(3).vehicles().front();
    vehicle.controller_name(std::string(count, 'n').c_str());
    vehicle.measured().signals().assign(count % 3, 1.5);
    vehicle.controller().numbers().assign(count % 2, 0.5);
    all.emplace_back().vehicles().assign(count % 4, vehicle);
  }
  return all;
}
template <>
std::vector<Commands> make_messages() {
  std::vector<Commands> all = {{}, make_message<Commands>(1), make_message<Commands>(2)};
  for (std::size_t count = 0; count < 9; ++count) {
    ControlCommand command = make_message<Commands>(3).vehicles().front();
    command.reference().stage_name(std::string(count, 's').c_str());
    command.controller().numbers().assign(count % 3, 0.5);
    Commands& sample = all.emplace_back();
    sample.client_name(std::string(8 - count, 'c').c_str());
    sample.vehicles().assign(count % 4, command);
  }
  return all;
}
template <>
std::vector<RecordBatch> make_messages() {
  std::vector<RecordBatch> all = {{}, make_message<RecordBatch>(1), make_message<RecordBatch>(2)};
  for (std::size_t count = 0; count < 9; ++count) {
    RecordEntry entry = make_message<RecordBatch>(3).entries().front();
    entry.client_name(std::string(count, 'c').c_str());
    entry.measured().assign(count % 2, entry.truth());
    entry.truth().signals().clear();
    RecordBatch& sample = all.emplace_back();
    sample.is_last(count % 2 == 1);
    sample.entries().assign(count % 3, entry);
  }
  return all;
}

template <class Type>
class PlainCdrTest : public testing::Test {};
using Types = testing::Types<StatesPubSubType, CommandsPubSubType, RecordBatchPubSubType>;
TYPED_TEST_SUITE(PlainCdrTest, Types, );

TYPED_TEST(PlainCdrTest, WritesTheBytesOfTheGeneratedCode) {
  using Message = typename TypeParam::type;
  for (const Message& message : make_messages<Message>())
    EXPECT_EQ(write_plain(message), write_generated<TypeParam>(message));
}

TYPED_TEST(PlainCdrTest, ReadsWhatItWritesWhateverTheMessageHeld) {
  using Message = typename TypeParam::type;
  for (const Message& message : make_messages<Message>())
    for (const Message& held : make_messages<Message>())
      EXPECT_EQ(read_plain(write_plain(message), held), message);
}

TYPED_TEST(PlainCdrTest, WithAnyByteChangedItReadsWhatTheGeneratedCodeReadsOrNothing) {
  using Message = typename TypeParam::type;
  const Message message = make_messages<Message>()[5];
  const std::string bytes = write_plain(message);
  std::size_t refused = 0;
  // From behind the options, of which Fast CDR 2.3 takes a number of padding bytes.
  for (std::size_t at = plain_cdr::kHeader.size(); at < bytes.size(); ++at)
    for (const char change : {'\x01', '\x7f', '\xff'}) {
      std::string changed = bytes;
      changed[at] = static_cast<char>(changed[at] ^ change);
      const auto got = read_plain<Message>(changed);
      refused += !got;
      if (!got) continue;
      // Compared by bytes, for a number may have become NaN.
      ASSERT_EQ(write_plain(*got), write_plain(read_generated<Message>(changed))) << at;
    }
  EXPECT_GT(refused, 0u);
}

TYPED_TEST(PlainCdrTest, NoPartOfASampleIsOne) {
  using Message = typename TypeParam::type;
  const std::string bytes = write_plain(make_messages<Message>()[5]);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    ASSERT_FALSE(read_plain<Message>(bytes.substr(0, size))) << size;
  EXPECT_FALSE(read_plain<Message>(bytes + '\0'));
  EXPECT_TRUE(read_plain<Message>(bytes));
}

TYPED_TEST(PlainCdrTest, RefusesARoomThatIsTooSmall) {
  using Message = typename TypeParam::type;
  const Message message = make_messages<Message>()[1];
  rtps::SerializedPayload_t payload(plain_cdr::calc_size(message) - 1);
  EXPECT_FALSE(plain_cdr::write(message, payload));
}

}  // namespace
}  // namespace sls::bus
