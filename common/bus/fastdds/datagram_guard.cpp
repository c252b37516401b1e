#include "common/bus/fastdds/datagram_guard.hpp"

#include <cstring>

namespace sls::bus {
namespace {

// RTPS 2.5, sections 8.3 and 9.4: the header and the submessages.
constexpr std::size_t kHeader = 20, kSubmessageHeader = 4, kBitmapBits = 256;
enum Submessage : std::uint8_t {
  kPad = 0x01,
  kAckNack = 0x06,
  kHeartbeat = 0x07,
  kGap = 0x08,
  kInfoTimestamp = 0x09,
  kNackFrag = 0x12,
  kHeartbeatFrag = 0x13,
  kData = 0x15,
  kDataFrag = 0x16,
  kStatistics = 0x80,  // of Fast DDS
};

/// Reads the numbers of one submessage.
class Fields {
 public:
  Fields(const std::uint8_t* data, std::size_t size, bool is_little)
      : data_(data), size_(size), is_little_(is_little) {}

  bool has(std::size_t place, std::size_t bytes) const { return place + bytes <= size_; }
  std::uint64_t read(std::size_t place, std::size_t bytes) const {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i)
      value = value << 8 | data_[place + (is_little_ ? bytes - 1 - i : i)];
    return value;
  }
  /// A number of a sample: the upper half comes first.
  std::int64_t read_number(std::size_t place) const {
    return static_cast<std::int64_t>(read(place, 4) << 32 | read(place + 4, 4));
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  bool is_little_;
};

bool is_number(std::int64_t number) { return number >= 0 && number <= kMostSequenceNumber; }

/// A set of numbers at `place`: its first one, the count of its bits, the bits.
bool is_set(const Fields& fields, std::size_t place, std::size_t base_bytes) {
  if (!fields.has(place, base_bytes + 4)) return false;
  const std::uint64_t bits = fields.read(place + base_bytes, 4);
  return bits <= kBitmapBits && fields.has(place + base_bytes + 4, (bits + 31) / 32 * 4);
}

const char* judge_gap(const Fields& fields) {
  constexpr std::size_t kStart = 8, kSet = 16;
  if (!is_set(fields, kSet, 8)) return "a GAP that is cut off";
  const std::int64_t first = fields.read_number(kStart), end = fields.read_number(kSet);
  if (first < 1 || end < first || !is_number(end) || end - first > kMostIrrelevant)
    return "a GAP without end";
  return nullptr;
}

const char* judge_heartbeat(const Fields& fields) {
  constexpr std::size_t kFirst = 8, kLast = 16, kEnd = 28;
  if (!fields.has(0, kEnd)) return "a HEARTBEAT that is cut off";
  const std::int64_t first = fields.read_number(kFirst), last = fields.read_number(kLast);
  if (first < 1 || !is_number(first) || !is_number(last) || last < first - 1)
    return "a HEARTBEAT without end";
  return nullptr;
}

const char* judge_fragment(const Fields& fields) {
  constexpr std::size_t kNumber = 12, kFirst = 20, kCount = 24, kFragment = 26, kSample = 28,
                        kEnd = 32;
  if (!fields.has(0, kEnd)) return "a fragment that is cut off";
  const std::uint64_t first = fields.read(kFirst, 4), count = fields.read(kCount, 2),
                      bytes = fields.read(kFragment, 2), sample = fields.read(kSample, 4);
  if (sample == 0 || sample > kMostSampleBytes) return "a fragment of a sample of impossible size";
  if (first == 0 || count == 0 || bytes == 0 || (first - 1 + count - 1) * bytes >= sample)
    return "a fragment beyond its sample";
  return is_number(fields.read_number(kNumber)) ? nullptr : "a fragment without number";
}

const char* judge_submessage(std::uint8_t kind, const Fields& fields) {
  switch (kind) {
    case kGap:
      return judge_gap(fields);
    case kHeartbeat:
      return judge_heartbeat(fields);
    case kDataFrag:
      return judge_fragment(fields);
    case kData:
      return fields.has(0, 20) && is_number(fields.read_number(12)) ? nullptr
                                                                    : "a DATA without number";
    case kAckNack:
      return is_set(fields, 8, 8) && is_number(fields.read_number(8)) ? nullptr
                                                                      : "a malformed ACKNACK";
    case kNackFrag:
      return is_set(fields, 16, 4) && is_number(fields.read_number(8)) ? nullptr
                                                                       : "a malformed NACK_FRAG";
    case kHeartbeatFrag:
      return fields.has(0, 24) && is_number(fields.read_number(8)) ? nullptr
                                                                   : "a malformed HEARTBEAT_FRAG";
    default:
      return nullptr;
  }
}

}  // namespace

DatagramVerdict judge_datagram(const std::uint8_t* data, std::size_t size) {
  if (size < kHeader || std::memcmp(data, "RTPS", 4) != 0) return {"no RTPS message", 0};
  for (std::size_t place = kHeader; place < size;) {
    if (size - place < kSubmessageHeader) return {"a submessage that is cut off", 0};
    const std::uint8_t kind = data[place];
    const bool is_little = (data[place + 1] & 1) != 0;
    const std::uint8_t* content = data + place + kSubmessageHeader;
    const std::size_t rest = size - place - kSubmessageHeader;
    std::size_t length = Fields(data + place + 2, 2, is_little).read(0, 2);
    if (length == 0 && kind != kPad && kind != kInfoTimestamp) length = rest;  // it is the last
    if (length > rest) return {"a submessage that is cut off", 0};
    // The library asserts that its statistics end the message. Nothing here needs them.
    if (kind == kStatistics)
      return length == rest ? DatagramVerdict{nullptr, place}
                            : DatagramVerdict{"statistics in the middle of a message", 0};
    if (const char* defect = judge_submessage(kind, Fields(content, length, is_little)))
      return {defect, 0};
    place += kSubmessageHeader + (length + 3) / 4 * 4;
  }
  return {nullptr, size};
}

bool RefusedDatagrams::note(const std::string& address) {
  const std::lock_guard lock(mutex_);
  ++count_;
  const auto known = by_sender_.find(address);
  if (known != by_sender_.end()) return ++known->second == 0;
  if (by_sender_.size() >= kMostSenders) return false;
  by_sender_[address] = 1;
  return true;
}

std::uint64_t RefusedDatagrams::count() const {
  const std::lock_guard lock(mutex_);
  return count_;
}

}  // namespace sls::bus
