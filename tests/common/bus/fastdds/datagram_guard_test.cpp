#include "common/bus/fastdds/datagram_guard.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "common/bus/fastdds/host_id.hpp"

namespace sls::bus {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// The bytes that `text` names in hexadecimal.
Bytes read_hex(const std::string& text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

/// The header of a message and, after it, submessages in hexadecimal.
Bytes make_message(const std::string& submessages) {
  Bytes bytes = read_hex("52545053" "0203" "010f" "0102030405060708090a0b0c");
  for (const std::uint8_t byte : read_hex(submessages)) bytes.push_back(byte);
  return bytes;
}

std::string judge(const Bytes& bytes) {
  const char* defect = judge_datagram(bytes.data(), bytes.size()).defect;
  return defect ? defect : "";
}

const std::string kEntities = "000001c7" "000001c2";
std::string zeros(std::size_t bytes) { return std::string(2 * bytes, '0'); }
const std::string kStatistics = "80013800" + zeros(56);

struct Case {
  const char* name;
  std::string submessages;
  std::string defect;
};

TEST(DatagramGuardTest, HarmfulMessagesAreRefused) {
  const std::string ack = "06011800" + kEntities + "00000000" "01000000" "00000000" "01000000";
  const Case cases[] = {
      {"heartbeat", "07011c00" + kEntities + "00000000" "01000000" "00000000" "05000000" "01000000", ""},
      {"empty history", "07011c00" + kEntities + "00000000" "06000000" "00000000" "05000000" "01000000", ""},
      {"distant heartbeat", "07011c00" + kEntities + "01000000" "01000000" "01000000" "05000000" "01000000",
       "a HEARTBEAT without end"},
      {"big-endian distant heartbeat",
       "0700001c" + kEntities + "00000001" "00000001" "00000001" "00000005" "00000001",
       "a HEARTBEAT without end"},
      {"heartbeat cut off", "07011800" + kEntities + "00000000" "01000000" "00000000" "05000000",
       "a HEARTBEAT that is cut off"},
      {"gap", "08011c00" + kEntities + "00000000" "01000000" "00000000" "09000000" "00000000", ""},
      {"endless gap", "08011c00" + kEntities + "00000000" "01000000" "ffffff7f" "ffffffff" "00000000",
       "a GAP without end"},
      {"long gap", "08011c00" + kEntities + "00000000" "01000000" "00000000" "00000200" "00000000",
       "a GAP without end"},
      {"gap of too many bits", "08011c00" + kEntities + "00000000" "01000000" "00000000" "09000000" "01010000",
       "a GAP that is cut off"},
      {"fragment", "16012400" "00001000" + kEntities + "00000000" "01000000" "01000000" "0100" "0004" "00080000" +
       zeros(4), ""},
      {"fragment of 4 GB", "16012400" "00001000" + kEntities + "00000000" "01000000" "01000000" "0100" "0004"
       "ffffffff" + zeros(4), "a fragment of a sample of impossible size"},
      {"fragment beyond its sample", "16012400" "00001000" + kEntities +
       "00000000" "01000000" "04000000" "0100" "0004" "00080000" + zeros(4), "a fragment beyond its sample"},
      {"fragments of nothing", "16012400" "00001000" + kEntities + "00000000" "01000000" "01000000" "0100" "0000"
       "00080000" + zeros(4), "a fragment beyond its sample"},
      {"statistics in the middle", kStatistics + "01010000", "statistics in the middle of a message"},
      {"statistics of a wrong length", "80010400" + zeros(60), "statistics in the middle of a message"},
      {"length beyond the message", "15010001" + zeros(8), "a submessage that is cut off"},
      {"half a header", "1501", "a submessage that is cut off"},
      {"padding", "01010000" "09010000" + ack + "00000000", ""},
      {"unknown kind", "7f010400" "00000000", ""},
  };
  for (const Case& one : cases)
    EXPECT_EQ(judge(make_message(one.submessages)), one.defect) << one.name;
  EXPECT_EQ(judge(read_hex("5254505302")), "no RTPS message");
  EXPECT_EQ(judge(Bytes(100, 'x')), "no RTPS message");
}

TEST(DatagramGuardTest, StatisticsAtTheEndAreCutOff) {
  const std::string ack = "06011800" + kEntities + "00000000" "01000000" "00000000" "00000000";
  const Bytes message = make_message(ack + kStatistics);
  const DatagramVerdict verdict = judge_datagram(message.data(), message.size());
  EXPECT_EQ(verdict.defect, nullptr);
  EXPECT_EQ(verdict.bytes, message.size() - kStatistics.size() / 2);
}

/// Whatever arrives, nothing beyond it is read: the sanitizer judges.
TEST(DatagramGuardTest, NothingBeyondADatagramIsRead) {
  std::mt19937_64 random(1);
  const std::uint8_t kinds[] = {0x01, 0x06, 0x07, 0x08, 0x09, 0x0e, 0x12, 0x13, 0x15, 0x16, 0x30, 0x80};
  for (int i = 0; i < 20'000; ++i) {
    Bytes message = make_message("");
    for (std::size_t left = random() % 120; left > 0; --left)
      message.push_back(static_cast<std::uint8_t>(random() % 4 ? random() % 4 : random()));
    if (message.size() > 24) {
      message[20] = kinds[random() % std::size(kinds)];
      message[22] = static_cast<std::uint8_t>(message.size() - 24);
      message[23] = 0;
    }
    message.shrink_to_fit();
    EXPECT_LE(judge_datagram(message.data(), message.size()).bytes, message.size());
  }
}

TEST(DatagramGuardTest, EachSenderIsNamedOnce) {
  RefusedDatagrams refused;
  EXPECT_TRUE(refused.note("10.0.0.1"));
  EXPECT_FALSE(refused.note("10.0.0.1"));
  EXPECT_TRUE(refused.note("10.0.0.2"));
  for (int i = 0; i < 200; ++i) refused.note("10.0.1." + std::to_string(i));
  EXPECT_FALSE(refused.note("10.0.2.1")) << "there are too many";
  EXPECT_EQ(refused.count(), 204);
}

TEST(HostIdTest, TheBuildOfTheMiddlewareMarksTheHost) {
  EXPECT_GE(middleware_build(), 1);
  EXPECT_LT(middleware_build(), 1 << 15);
}

}  // namespace
}  // namespace sls::bus
