#include "common/bus/fastdds/datagram_guard.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "common/bus/fastdds/host_id.hpp"

namespace sls::bus {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// The header of a message and, after it, submessages in hexadecimal.
Bytes make_message(const std::string& submessages) {
  const std::string text = "525450530203010f0102030405060708090a0b0c" + submessages;
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

std::string judge(const Bytes& bytes) {
  const char* defect = judge_datagram(bytes.data(), bytes.size()).defect;
  return defect ? defect : "";
}

std::string zeros(std::size_t bytes) { return std::string(2 * bytes, '0'); }

std::string replace(std::string text, const std::string& old, const std::string& by) {
  return text.replace(text.find(old), old.size(), by);
}

// Reader and writer; numbers of samples, 4 bytes above and 4 below, little-endian; submessages.
const std::string kEntities = "000001c7000001c2", kAnnouncer = "00000000000100c2",
                  kHandshaker = "00000000000201c3", kWriters = "00000000000003c2";
const std::string kOne = "0000000001000000", kFive = "0000000005000000", kSix = "0000000006000000",
                  kDistant = "0100000001000000", kEndless = "ffffff7fffffffff";
const std::string kHeartbeat = "07011c00" + kEntities, kGap = "08011c00" + kEntities,
                  kFragment = "1601000000001c00" + kEntities + kOne, kRest = "01000000",
                  kStatistics = "80013800" + zeros(56), kEnd = "01000000",
                  kSample = "1505000000001000" + kEntities + kOne + "70001000" + zeros(16) + kEnd +
                            zeros(4);
// The token "abc" with one property "x": "y" and no bytes, and messages that end with it.
const std::string kToken = "040000006162630001000000020000007800000002000000790000" + zeros(5),
                  kGuid = "50001000" + zeros(15) + "01",
                  kIdentity = "1505000000001000" + kAnnouncer + kOne + "00030000" + kGuid +
                              "01102000" + kToken + kEnd,
                  kHandshake = "1505000000001000" + kHandshaker + kOne + "00010000" + zeros(96) +
                               "020000006100000001000000" + kToken;

TEST(DatagramGuardTest, HarmfulMessagesAreRefused) {
  const std::string malformed = "a malformed announcement", cut_off = "a DATA that is cut off",
                    cut_fragment = "a fragment that is cut off";
  const auto announce = [](const std::string& parameter) {
    return "1505000000001000" + kWriters + kOne + "00030000" + parameter + kEnd;
  };
  struct Case {
    const char* name;
    std::string submessages, defect;
  };
  const Case cases[] = {
      {"heartbeat", kHeartbeat + kOne + kFive + kRest, ""},
      {"of an empty history", kHeartbeat + kSix + kFive + kRest, ""},
      {"of a distant sample", kHeartbeat + kDistant + kDistant + kRest, "a HEARTBEAT without end"},
      {"of a distant end", kHeartbeat + kOne + kEndless + kRest, "a HEARTBEAT without end"},
      {"big-endian", "0700001c" + kEntities + "0000000100000001000000010000000500000001",
       "a HEARTBEAT without end"},
      {"short", "07011800" + kEntities + kOne + kFive, "a HEARTBEAT that is cut off"},
      {"gap", kGap + kOne + kSix + zeros(4), ""},
      {"endless", kGap + kOne + kEndless + zeros(4), "a GAP without end"},
      {"of 131,071 samples", kGap + kOne + "0000000000000200" + zeros(4), "a GAP without end"},
      {"of too many bits", kGap + kOne + kSix + "01010000", "a GAP that is cut off"},
      {"sample", kSample, ""},
      {"whose content is too early", replace(kSample, "00001000", "00000f00"), cut_off},
      {"too late", replace(kSample, "00001000", "0000ff7f"), cut_off},
      {"of own QoS", replace(kSample, "1505", "1507"), ""},
      {"without end", replace(replace(kSample, "1505", "1507"), kEnd, "70000000"), cut_off},
      {"without content", "1505000000001000" + kEntities + kOne, cut_off},
      {"fragment", kFragment + "010000000100000400080000" + zeros(1024), ""},
      {"the last one", kFragment + "030000000100000408080000" + zeros(8), ""},
      {"with less than it says", kFragment + "010000000100000400080000" + zeros(1023),
       cut_fragment},
      {"of a key", replace(kFragment, "1601", "1605") + "010000000100000400080000" + zeros(1024),
       cut_fragment},
      {"of 6 bytes", kFragment + "010000000100060000080000" + zeros(6),
       "a fragment beyond its sample"},
      {"of 4 GB", kFragment + "0100000001000004ffffffff" + zeros(4),
       "a fragment of a sample of impossible size"},
      {"beyond its sample", kFragment + "040000000100000400080000" + zeros(4),
       "a fragment beyond its sample"},
      {"of nothing", kFragment + "010000000100000000080000" + zeros(4),
       "a fragment beyond its sample"},
      {"partition", announce("29000c00010000000200000061000000"), ""},
      {"of 2^32 - 4 bytes", announce("29000c0001000000fcffffff61000000"), malformed},
      {"topic", announce("05000800ffffffff61000000"), malformed},
      {"filter", announce("35001400" + zeros(12) + "ffffffff61000000"), malformed},
      {"property", announce("59000c0001000000ffffffff61000000"), malformed},
      {"representations", announce("73000800ffffffff00000000"), malformed},
      {"shared data", announce("06800c00020000000000000000000000"), malformed},
      {"machine",
       announce("0380080004000000616263"
                "00"),
       ""},
      {"of 4 GB", announce("03800800ffffffff61000000"), malformed},
      {"flow controller",
       announce("01810c0000000000"
                "0200000061000000"),
       ""},
      {"of 4 GB", announce("01810c0000000000fcffffff61000000"), malformed},
      {"locators of an endpoint", announce("10800400ffffffff"), malformed},
      {"of the wire protocol", announce("00830400ffffffff"), malformed},
      {"key instead of data", replace(announce("05000800ffffffff61000000"), "1505", "1509"),
       malformed},
      {"of a participant that leaves",
       "1509000000001000" + kAnnouncer + kOne + "00030000" + kGuid + kEnd, ""},
      {"in one fragment",
       replace(kFragment, kEntities, kWriters) +
           "0100000001001000100000000003000005000800ffffffff00000000",
       malformed},
      {"in two",
       replace(kFragment, kEntities, kWriters) +
           "0100000001001000180000000003000005000800ffffffff00000000",
       "an announcement in fragments"},
      {"identity", kIdentity, ""},
      {"of 4 GB", replace(kIdentity, kToken.substr(0, 8), "ffffffff"), malformed},
      {"of nobody", replace(kIdentity, kGuid, "50001000" + zeros(16)), malformed},
      {"without participant", replace(kIdentity, kGuid, ""), malformed},
      {"of 2^31 properties", replace(kIdentity, "61626300010000", "616263000000f0"), malformed},
      {"longer than its announcement", replace(kIdentity, "01102000", "01102400"), malformed},
      {"handshake", kHandshake, ""},
      {"of 2^31 tokens", replace(kHandshake, "6100000001000000", "61000000000000f0"), malformed},
      {"statistics in the middle", kStatistics + "01010000",
       "statistics in the middle of a message"},
      {"longer than the message", "15010001" + zeros(8), "a submessage that is cut off"},
      {"half a header", "1501", "a submessage that is cut off"},
      {"padding and time", "010100000901080000000000000000000e010c00" + zeros(12), ""},
      {"unknown kind", "7f01040000000000", ""},
  };
  for (const Case& one : cases)
    EXPECT_EQ(judge(make_message(one.submessages)), one.defect) << one.name;
  EXPECT_EQ(judge(Bytes(5, 'R')), "no RTPS message");
  EXPECT_EQ(judge(Bytes(100, 'x')), "no RTPS message");
}

TEST(DatagramGuardTest, StatisticsAtTheEndAreCutOff) {
  const Bytes message = make_message("06011800" + kEntities + kOne + zeros(8) + kStatistics);
  const DatagramVerdict verdict = judge_datagram(message.data(), message.size());
  EXPECT_EQ(verdict.defect, nullptr);
  EXPECT_EQ(verdict.bytes, message.size() - kStatistics.size() / 2);
}

/// The sanitizer judges.
TEST(DatagramGuardTest, NothingBeyondADatagramIsRead) {
  std::mt19937_64 random(1);
  std::vector<Bytes> known;
  for (const std::string& one : {kHeartbeat + kOne + kFive + kRest, kGap + kOne + kSix + zeros(4),
                                 kFragment + zeros(16), kIdentity, kHandshake, kStatistics})
    known.push_back(make_message(one));
  for (int i = 0; i < 20'000; ++i) {
    Bytes message = known[random() % known.size()];
    for (std::size_t left = random() % 4; left > 0; --left)
      message[random() % message.size()] =
          static_cast<std::uint8_t>(random() % 2 ? random() : random() % 8);
    message[0] = 'R';
    message.resize(message.size() - random() % 2 * (random() % message.size()));
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
  EXPECT_EQ(refused.count(), 204u);
}

TEST(HostIdTest, TheBuildOfTheMiddlewareIsAPositiveNumberOf15Bits) {
  EXPECT_GE(middleware_build(), 1);
  EXPECT_LT(middleware_build(), 1 << 15);
}

}  // namespace
}  // namespace sls::bus
