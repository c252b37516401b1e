#include "tools/doctor/announcement.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace sls::doctor {
namespace {

using Bytes = std::vector<unsigned char>;

void append(Bytes& bytes, const Bytes& more) {
  for (const unsigned char byte : more) bytes.push_back(byte);
}

/// A parameter of a little-endian list.
Bytes make_parameter(unsigned id, const Bytes& value) {
  Bytes bytes = {static_cast<unsigned char>(id), static_cast<unsigned char>(id >> 8),
                 static_cast<unsigned char>(value.size()), 0};
  append(bytes, value);
  return bytes;
}

/// An announcement built by hand from the specification (RTPS 2.3, 8.3.3, 9.4.5, 9.6.2).
Bytes make_message(const std::string& name, bool is_secured) {
  Bytes body = {0, 0, 16, 0, 0, 0, 0, 0, 0x00, 0x01, 0x00, 0xc2,
                0, 0, 0,  0, 1, 0, 0, 0, 0,    3,    0,    0};
  Bytes text = {static_cast<unsigned char>(name.size() + 1), 0, 0, 0};
  text.insert(text.end(), name.begin(), name.end());
  text.push_back(0);
  while (text.size() % 4 != 0) text.push_back(0);
  append(body, make_parameter(0x0062, text));
  if (is_secured) append(body, make_parameter(0x1001, {0, 0, 0, 0}));
  append(body, make_parameter(0x0001, {}));
  Bytes message = {'R', 'T', 'P', 'S', 2, 3, 1, 15, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  append(message, {0x09, 1, 8, 0, 1, 2, 3, 4, 5, 6, 7, 8});  // a time stamp, which is skipped
  append(message, {0x15, 5, static_cast<unsigned char>(body.size()), 0});
  append(message, body);
  return message;
}

TEST(AnnouncementTest, IsReadFromAMessage) {
  const Bytes message = make_message("sim_server", false);
  const auto found = parse_announcement(message.data(), message.size());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->name, "sim_server");
  EXPECT_FALSE(found->is_secured);
  EXPECT_EQ(found->id.bytes, (std::array<std::uint8_t, 12>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
  const Bytes secured = make_message("recorder", true);
  EXPECT_TRUE(parse_announcement(secured.data(), secured.size())->is_secured);
}

TEST(AnnouncementTest, ATruncatedAnnouncementIsRefused) {
  const Bytes message = make_message("sim_server", true);
  for (std::size_t size = 0; size < message.size(); ++size) {
    const Bytes cut(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(parse_announcement(cut.data(), cut.size())) << size;
  }
}

TEST(AnnouncementTest, WithAnyByteChangedItIsReadWithinItsBounds) {
  for (const unsigned change : {0x01u, 0x80u, 0xffu}) {
    Bytes message = make_message("sim_server", true);
    for (auto& byte : message) {
      byte = static_cast<unsigned char>(byte ^ change);
      const auto found = parse_announcement(message.data(), message.size());
      EXPECT_TRUE(!found || found->name.size() < message.size());
      byte = static_cast<unsigned char>(byte ^ change);
    }
  }
}

TEST(AnnouncementTest, SamplesOfAnotherWriterAreNoAnnouncements) {
  Bytes message = make_message("sim_server", false);
  message[20 + 12 + 4 + 11] = 0xc7;  // the writer's kind
  EXPECT_FALSE(parse_announcement(message.data(), message.size()));
}

}  // namespace
}  // namespace sls::doctor
