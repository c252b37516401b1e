#include "common/bus/fastdds/datagram_guard.hpp"

#include <algorithm>
#include <cstring>

namespace sls::bus {
namespace {

// RTPS 2.5, sections 8.3 and 9.4: the header and the submessages.
constexpr std::size_t kHeader = 20, kSubmessageHeader = 4, kBitmapBits = 256,
                      kWriter = 8;  // place in a DATA or a fragment
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

/// Reads texts, tokens of DDS Security and other lists one after the other. Once one does not fit,
/// `is_whole()` is false.
class Lists {
 public:
  explicit Lists(const Fields& fields, std::size_t place = 0) : fields_(fields), place_(place) {}

  bool is_whole() const { return is_whole_; }
  std::size_t read_count() {
    place_ = (place_ + 3) / 4 * 4;
    is_whole_ = is_whole_ && fields_.has(place_, 4);
    if (!is_whole_) return 0;
    place_ += 4;
    return static_cast<std::size_t>(fields_.read(place_ - 4, 4));
  }
  /// As many elements as a count says, each of `bytes`.
  void skip_elements(std::size_t bytes = 1) {
    const std::size_t all = bytes * read_count();
    is_whole_ = is_whole_ && fields_.has(place_, all);
    if (is_whole_) place_ += all;
  }
  void skip_text() { skip_elements(); }
  /// `each` times as many texts as a count says.
  void skip_texts(std::size_t each = 1) {
    for (std::size_t left = each * read_count(); is_whole_ && left > 0; --left) skip_text();
  }
  /// The name of a class, pairs of texts, pairs of a text and bytes.
  void skip_token() {
    skip_text();
    skip_texts(2);
    skip_texts(2);
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

// Writers of announcements, plain and secure: Fast DDS takes as much memory as a list in them says,
// and secured readers accept them unprotected.
bool announces_participants(std::uint32_t writer) {
  return writer == 0x0001'00c2 || writer == 0xff01'01c2;
}
bool announces_endpoints(std::uint32_t writer) {
  const std::uint32_t number = writer & 0x00ff'ffff;
  return number == 0x03c2 || number == 0x04c2;
}
bool sends_tokens(std::uint32_t writer) {  // handshake, keys
  return writer == 0x0002'01c3 || writer == 0xff02'02c3;
}

constexpr std::uint64_t kListEnd = 0x0001, kParticipantGuid = 0x0050;  // parameters

bool is_parameter_whole(std::uint64_t number, const Fields& content) {
  constexpr std::size_t kGuid = 16;
  Lists lists(content);
  switch (number) {
    case 0x0005:  // names of topic, type and entity
    case 0x0007:
    case 0x0062:
    case 0x8003:  // number of a machine, of Fast DDS
      lists.skip_text();
      break;
    case 0x0029:  // partitions
      lists.skip_texts();
      break;
    case 0x0035:  // filter: names, expression, its parameters
      for (int text = 0; text < 4; ++text) lists.skip_text();
      lists.skip_texts();
      break;
    case kParticipantGuid:  // its GUID: Fast DDS asserts that there is one
      for (std::size_t i = 0; i < kGuid && content.has(i, 1); ++i)
        if (content.read(i, 1) != 0) return content.has(0, kGuid);
      return false;
    case 0x0059:  // properties
      lists.skip_texts(2);
      break;
    case 0x0073:  // representations
      lists.skip_elements(2);
      break;
    case 0x8006:  // domains of shared data, of Fast DDS
      lists.skip_elements(8);
      break;
    case 0x8101:  // how Fast DDS publishes: a number, the name of its flow controller
      lists = Lists(content, 4);
      lists.skip_text();
      break;
    case 0x8010:  // endpoints and wire protocol: Fast DDS 3.2 and 3.3 bound none of their lists of
    case 0x8300:  // locators, and send them only with fastdds.serialize_optional_qos
      return false;
    case 0x1001:  // identity, permissions and their states
    case 0x1002:
    case 0x1003:
    case 0x1006:
      lists.skip_token();
      break;
  }
  return lists.is_whole();
}

/// Length of the list of parameters at `place`, each a number, a length and content, with what ends
/// it; 0 if it has no end, one of them is not whole, or there is none of number `wanted`.
std::size_t measure_parameters(const Fields& fields, std::size_t place = 0,
                               std::uint64_t wanted = kListEnd) {
  bool is_there = false;
  for (std::size_t at = place; fields.has(at, 4);) {
    const std::uint64_t number = fields.read(at, 2), length = fields.read(at + 2, 2);
    at += 4;
    is_there = is_there || number == wanted;
    if (number == kListEnd) return is_there ? at - place : 0;
    if (!fields.has(at, length) ||
        !is_parameter_whole(number, fields.part(at, length, fields.is_little())))
      return 0;
    at += (length + 3) / 4 * 4;
  }
  return 0;
}

/// `payload` is a message of the handshake: who writes to whom, its class, tokens.
bool is_handshake_whole(const Fields& payload) {
  constexpr std::size_t kIdentities = 96;
  Lists lists(payload, kIdentities);
  lists.skip_text();
  for (std::size_t left = lists.read_count(); lists.is_whole() && left > 0; --left)
    lists.skip_token();
  return lists.is_whole();
}

/// Where the payload of a DATA or a fragment begins, whose own fields take `least` bytes; 0 if it
/// is not inside. Fast DDS computes with what the message says of it.
std::size_t find_payload(const Fields& fields, std::uint8_t flags, std::size_t least) {
  constexpr std::size_t kToPayload = 2;
  constexpr std::uint8_t kHasOwnQos = 0x02;
  if (!fields.has(0, least)) return 0;
  std::size_t place = kToPayload + 2 + static_cast<std::size_t>(fields.read(kToPayload, 2));
  if (place < least || place > fields.size()) return 0;
  if ((flags & kHasOwnQos) == 0) return place;
  const std::size_t parameters = measure_parameters(fields, place);
  return parameters > 0 ? place + parameters : 0;
}

/// A whole sample at `place`.
const char* judge_sample(const Fields& fields, std::size_t place) {
  const std::uint32_t writer = fields.read_entity(kWriter);
  const bool is_little = fields.has(place, 4) && (fields.read_entity(place) & 0x0001'0000) != 0;
  const Fields payload = fields.part(place + 4, fields.size(), is_little);  // of its representation
  const bool is_whole =
      announces_participants(writer) ? measure_parameters(payload, 0, kParticipantGuid) > 0
      : announces_endpoints(writer)  ? measure_parameters(payload) > 0
                                     : !sends_tokens(writer) || is_handshake_whole(payload);
  return is_whole ? nullptr : "a malformed announcement";
}

const char* judge_data(const Fields& fields, std::uint8_t flags) {
  constexpr std::size_t kNumber = 12, kLeast = 20;
  constexpr std::uint8_t kHasData = 0x04, kHasKey = 0x08;
  const std::size_t place = find_payload(fields, flags, kLeast);
  if (place == 0 || ((flags & (kHasData | kHasKey)) != 0 && place == fields.size()))
    return "a DATA that is cut off";
  if (!is_number(fields.read_number(kNumber))) return "a DATA without number";
  // Since 3.3 Fast DDS reads a key as it reads data.
  return (flags & (kHasData | kHasKey)) != 0 ? judge_sample(fields, place) : nullptr;
}

const char* judge_fragment(const Fields& fields, std::uint8_t flags) {
  constexpr std::size_t kNumber = 12, kFirst = 20, kCount = 24, kFragment = 26, kSample = 28,
                        kEnd = 32;
  constexpr std::uint8_t kHasKey = 0x04;
  const std::size_t place = find_payload(fields, flags, kEnd);
  if (place == 0 || (flags & kHasKey) != 0) return "a fragment that is cut off";
  const std::uint64_t first = fields.read(kFirst, 4), count = fields.read(kCount, 2),
                      bytes = fields.read(kFragment, 2), sample = fields.read(kSample, 4);
  if (sample == 0 || sample > kMostSampleBytes) return "a fragment of a sample of impossible size";
  // Fast DDS keeps a list in fragments that it has not yet, in words at multiples of 4.
  if (first == 0 || count == 0 || bytes == 0 || bytes % 4 != 0 ||
      (first - 1 + count - 1) * bytes >= sample)
    return "a fragment beyond its sample";
  if (fields.size() - place < std::min(count * bytes, sample - (first - 1) * bytes))
    return "a fragment that is cut off";
  if (!is_number(fields.read_number(kNumber))) return "a fragment without number";
  if (first == 1 && count * bytes >= sample) return judge_sample(fields, place);
  // Only Cyclone DDS sends fragments of announcements: of the handshake.
  const std::uint32_t writer = fields.read_entity(kWriter);
  return announces_participants(writer) || announces_endpoints(writer)
             ? "an announcement in fragments"
             : nullptr;
}

const char* judge_submessage(std::uint8_t kind, std::uint8_t flags, const Fields& fields) {
  switch (kind) {
    case kGap:
      return judge_gap(fields);
    case kHeartbeat:
      return judge_heartbeat(fields);
    case kDataFrag:
      return judge_fragment(fields, flags);
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
