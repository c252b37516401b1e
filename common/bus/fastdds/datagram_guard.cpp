#include "common/bus/fastdds/datagram_guard.hpp"

#include <algorithm>
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

  std::size_t size() const { return size_; }
  bool is_little() const { return is_little_; }
  bool has(std::size_t place, std::size_t bytes) const {
    return place <= size_ && bytes <= size_ - place;
  }
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
  /// An identifier of an endpoint: bytes in their order.
  std::uint32_t read_entity(std::size_t place) const {
    return static_cast<std::uint32_t>(Fields(data_ + place, 4, false).read(0, 4));
  }
  /// What comes from `place` on, at most `bytes` of it.
  Fields part(std::size_t place, std::size_t bytes, bool is_little) const {
    place = std::min(place, size_);
    return {data_ + place, std::min(bytes, size_ - place), is_little};
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  bool is_little_;
};

/// Reads tokens of DDS Security one after the other. Once one does not fit, `is_whole()` is false.
class Tokens {
 public:
  explicit Tokens(const Fields& fields, std::size_t place = 0) : fields_(fields), place_(place) {}

  bool is_whole() const { return is_whole_; }
  std::size_t read_count() {
    place_ = (place_ + 3) / 4 * 4;
    is_whole_ = is_whole_ && fields_.has(place_, 4);
    if (!is_whole_) return 0;
    place_ += 4;
    return static_cast<std::size_t>(fields_.read(place_ - 4, 4));
  }
  void skip_bytes() {
    const std::size_t bytes = read_count();
    is_whole_ = is_whole_ && fields_.has(place_, bytes);
    if (is_whole_) place_ += bytes;
  }
  /// The name of a class, pairs of texts, pairs of a text and bytes.
  void skip_token() {
    skip_bytes();
    for (int kind = 0; kind < 2; ++kind)
      for (std::size_t left = 2 * read_count(); is_whole_ && left > 0; --left) skip_bytes();
  }

 private:
  Fields fields_;
  std::size_t place_;
  bool is_whole_ = true;
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

/// Announcements of participants, plain and secure, and messages of the handshake. Fast DDS takes
/// as much memory as a token in them says that it has.
enum Writer : std::uint32_t {
  kAnnouncer = 0x0001'00c2,
  kSecureAnnouncer = 0xff01'01c2,
  kHandshake = 0x0002'01c3,
};

bool has_tokens(std::uint32_t writer) {
  return writer == kAnnouncer || writer == kSecureAnnouncer || writer == kHandshake;
}

/// `payload` is a list of parameters: number, length, content.
bool are_tokens_whole(const Fields& payload) {
  constexpr std::uint64_t kEnd = 0x0001, kFirstToken = 0x1001, kLastToken = 0x1006,
                          kEndpointFlags = 0x1004, kParticipantFlags = 0x1005;  // of DDS Security
  for (std::size_t place = 0; payload.has(place, 4);) {
    const std::uint64_t number = payload.read(place, 2), length = payload.read(place + 2, 2);
    if (number == kEnd) return true;
    place += 4;
    if (!payload.has(place, length)) return false;
    if (number >= kFirstToken && number <= kLastToken && number != kEndpointFlags &&
        number != kParticipantFlags) {
      Tokens tokens(payload.part(place, length, payload.is_little()));
      tokens.skip_token();
      if (!tokens.is_whole()) return false;
    }
    place += (length + 3) / 4 * 4;
  }
  return true;
}

/// `payload` is a message of the handshake: who writes to whom, its class, tokens.
bool is_handshake_whole(const Fields& payload) {
  constexpr std::size_t kIdentities = 96;
  Tokens tokens(payload, kIdentities);
  tokens.skip_bytes();
  for (std::size_t left = tokens.read_count(); tokens.is_whole() && left > 0; --left)
    tokens.skip_token();
  return tokens.is_whole();
}

const char* judge_data(const Fields& fields, std::uint8_t flags) {
  constexpr std::size_t kToPayload = 2, kWriter = 8, kNumber = 12, kLeast = 20;
  constexpr std::uint8_t kHasOwnQos = 0x02, kHasData = 0x04;
  if (!fields.has(0, kLeast) || !is_number(fields.read_number(kNumber)))
    return "a DATA without number";
  const std::uint32_t writer = fields.read_entity(kWriter);
  if (!has_tokens(writer) || (flags & kHasData) == 0) return nullptr;
  std::size_t place = kToPayload + 2 + static_cast<std::size_t>(fields.read(kToPayload, 2));
  if ((flags & kHasOwnQos) != 0) {  // parameters, too, up to the one that ends them
    while (fields.has(place, 4) && fields.read(place, 2) != 0x0001)
      place += 4 + static_cast<std::size_t>(fields.read(place + 2, 2));
    place += 4;
  }
  if (!fields.has(place, 4)) return "a DATA that is cut off";
  const bool is_little = (fields.read_entity(place) & 0x0001'0000) != 0;  // of its representation
  const Fields payload = fields.part(place + 4, fields.size(), is_little);
  const bool is_whole =
      writer == kHandshake ? is_handshake_whole(payload) : are_tokens_whole(payload);
  return is_whole ? nullptr : "an identity that is longer than its message";
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

const char* judge_submessage(std::uint8_t kind, std::uint8_t flags, const Fields& fields) {
  switch (kind) {
    case kGap:
      return judge_gap(fields);
    case kHeartbeat:
      return judge_heartbeat(fields);
    case kDataFrag:
      return judge_fragment(fields);
    case kData:
      return judge_data(fields, flags);
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
    if (const char* defect =
            judge_submessage(kind, data[place + 1], Fields(content, length, is_little)))
      return {defect, 0};
    place += kSubmessageHeader + (length + 3) / 4 * 4;
  }
  return {nullptr, size};
}

bool RefusedDatagrams::note(const std::string& address) {
  const std::lock_guard lock(mutex_);
  ++count_;
  return senders_.size() < kMostSenders && senders_.insert(address).second;
}

std::uint64_t RefusedDatagrams::count() const {
  const std::lock_guard lock(mutex_);
  return count_;
}

}  // namespace sls::bus
