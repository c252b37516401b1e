#include "common/bus/fastdds/plain_announcements.hpp"

#include <gtest/gtest.h>

namespace sls::bus {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Bytes word(std::uint32_t value) {
  return {static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8),
          static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 24)};
}

Bytes text(const std::string& value) {
  Bytes bytes =
      word(static_cast<std::uint32_t>(value.size() + 1)) + Bytes(value.begin(), value.end());
  bytes.push_back(0);
  bytes.resize((bytes.size() + 3) / 4 * 4);
  return bytes;
}

Bytes parameter(std::uint16_t id, const Bytes& value) {
  return word(id | static_cast<std::uint32_t>(value.size()) << 16) + value;
}

const Bytes kVersion = parameter(0x0059, word(1) + text("sls.fastdds") + text("2.9.1"));
const Bytes kName = parameter(0x0062, text("control_client"));
const Bytes kPlainIds = {0, 1, 0, 0xc7, 0, 1, 0, 0xc2};
const Bytes kSecureIds = {0xff, 1, 1, 0xc7, 0xff, 1, 1, 0xc2};

constexpr std::uint8_t kByFastDds = 15, kByCyclone = 16;  // vendors

/// By the RTPS specification 2.3, 8.3.7 and 9.4: a header, a time, and an announcement.
Bytes make_message(const Bytes& parameters, std::uint8_t number = 1, const Bytes& ids = kPlainIds,
                   std::uint8_t vendor = kByFastDds) {
  const Bytes header = {'R', 'T', 'P', 'S', 2, 3, 1, vendor, 1,  15,
                        3,   4,   5,   6,   7, 8, 9, 10,     11, 12};
  const Bytes time = Bytes{0x09, 1, 8, 0} + word(7) + word(8);
  const Bytes body =
      Bytes{0, 0, 16, 0} + ids + word(0) + word(number) + Bytes{0, 3, 0, 0} + parameters + word(1);
  return header + time + Bytes{0x15, 5, static_cast<std::uint8_t>(body.size()), 0} + body;
}

std::optional<PlainAnnouncement> find(const Bytes& message) {
  return find_announcement(message.data(), message.size());
}

TEST(PlainAnnouncementsTest, AnAnnouncementOfCycloneIsRepeatedWithTheIdsOfTheSecureWriter) {
  const auto found = find(make_message(kName, 1, kPlainIds, kByCyclone));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->name, "control_client");
  EXPECT_FALSE(found->is_secured);
  EXPECT_EQ(found->sender, (PeerId{{1, 15, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}}));
  EXPECT_EQ(found->as_secure, make_message(kName, 1, kSecureIds, kByCyclone));
}

TEST(PlainAnnouncementsTest, ALaterAnnouncementSaysThatThoseBeforeDoNotExist) {
  const auto found = find(make_message(kName, 3, kPlainIds, kByCyclone));
  ASSERT_TRUE(found);
  const Bytes expected = make_message(kName, 3, kSecureIds, kByCyclone);
  const Bytes gap =
      Bytes{0x08, 1, 28, 0} + kSecureIds + word(0) + word(1) + word(0) + word(3) + word(0);
  EXPECT_EQ(found->as_secure, Bytes(expected.begin(), expected.begin() + 20) + gap +
                                  Bytes(expected.begin() + 20, expected.end()));
}

TEST(PlainAnnouncementsTest, AnnouncementsOfOthersAreNotRepeated) {
  const Bytes token = parameter(0x1001, word(0));
  const auto of_fastdds = find(make_message(kVersion + kName + token));
  ASSERT_TRUE(of_fastdds);
  EXPECT_EQ(of_fastdds->name, "control_client");
  EXPECT_EQ(of_fastdds->version, "2.9.1");
  EXPECT_TRUE(of_fastdds->is_secured);
  EXPECT_EQ(of_fastdds->as_secure, Bytes());
  const auto of_another_vendor = find(make_message(kName, 1, kPlainIds, 17));
  ASSERT_TRUE(of_another_vendor);
  EXPECT_EQ(of_another_vendor->as_secure, Bytes());
}

TEST(PlainAnnouncementsTest, OtherMessagesContainNone) {
  EXPECT_FALSE(find(make_message(kName, 1, {0, 0, 0, 0, 0, 0, 1, 3})));  // samples of a topic
  EXPECT_FALSE(find({}));
}

TEST(PlainAnnouncementsTest, MessagesOfAnyLengthAreReadWithinTheirBounds) {
  const Bytes whole = make_message(kVersion + kName, 3, kPlainIds, kByCyclone);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(find(Bytes(whole.begin(), whole.begin() + static_cast<long>(size)))) << size;
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (const std::uint8_t value : {0x00, 0x7f, 0xff}) {
      Bytes changed = whole;
      changed[at] = value;
      find(changed);  // judged by the address sanitizer
    }
}

TEST(PlainAnnouncementsTest, VersionsSince2_13AndTheLastBeforeHaveTheSecureWriter) {
  for (const char* version : {"2.10.3", "2.11.3", "2.12.2", "2.13.0", "2.14.3", "3.1.2"})
    EXPECT_TRUE(has_secure_announcements(version)) << version;
  for (const char* version : {"2.9.1", "2.9.4", "2.10.2", "2.11.2", "2.12.1", "", "x"})
    EXPECT_FALSE(has_secure_announcements(version)) << version;
}

}  // namespace
}  // namespace sls::bus
