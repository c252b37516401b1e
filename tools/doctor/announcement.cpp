#include "tools/doctor/announcement.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

namespace sls::doctor {
namespace {

// Numbers of the RTPS 2.x specification: submessages, entities, parameters.
constexpr std::size_t kHeaderSize = 20, kSubmessageHeaderSize = 4, kPrefixOffset = 8;
constexpr std::uint8_t kDataSubmessage = 0x15;
constexpr std::uint8_t kLittleEndian = 0x01, kInlineQos = 0x02, kPayload = 0x04;
constexpr std::array<unsigned char, 4> kParticipantWriter = {0x00, 0x01, 0x00, 0xc2};
constexpr std::uint16_t kEntityName = 0x0062, kIdentityToken = 0x1001, kEnd = 0x0001;

/// Reads forward. A read past the end returns zero and makes `is_good()` false.
class Cursor {
 public:
  Cursor(const unsigned char* data, std::size_t size, bool is_little)
      : data_(data), left_(size), is_little_(is_little) {}

  const unsigned char* skip(std::size_t count) {
    if (count > left_) {
      is_good_ = false;
      left_ = 0;
      return nullptr;
    }
    const unsigned char* here = data_;
    data_ += count;
    left_ -= count;
    return here;
  }
  std::uint32_t read(std::size_t bytes) {
    const unsigned char* here = skip(bytes);
    std::uint32_t value = 0;
    for (std::size_t i = 0; here && i < bytes; ++i)
      value = value << 8 | here[is_little_ ? bytes - 1 - i : i];
    return value;
  }
  Cursor part(std::size_t count, bool is_little) {
    const unsigned char* here = skip(count);
    return {here, here ? count : 0, is_little};
  }
  Cursor part(std::size_t count) { return part(count, is_little_); }
  std::size_t left() const { return left_; }
  bool is_good() const { return is_good_; }

 private:
  const unsigned char* data_;
  std::size_t left_;
  bool is_little_;
  bool is_good_ = true;
};

/// Calls `use(id, value)` for each parameter of a list, up to its end.
template <class Use>
bool read_parameters(Cursor& list, const Use& use) {
  while (list.left() > 0) {
    const auto id = static_cast<std::uint16_t>(list.read(2));
    const std::size_t size = list.read(2);
    if (id == kEnd) return true;
    Cursor value = list.part(size);
    if (!list.is_good()) return false;
    use(id, value);
  }
  return list.is_good();
}

std::string read_string(Cursor value) {
  const std::size_t size = value.read(4);
  const unsigned char* text = value.skip(size);
  if (!text || size == 0) return {};
  return {text, text + size - 1};
}

/// The body of a DATA submessage.
std::optional<Announcement> parse_data(Cursor body, std::uint8_t flags) {
  body.skip(4);  // extra flags, offset to inline QoS
  body.skip(4);  // reader
  const unsigned char* writer = body.skip(kParticipantWriter.size());
  body.skip(8);  // sequence number
  if (!writer || !std::equal(kParticipantWriter.begin(), kParticipantWriter.end(), writer))
    return std::nullopt;
  if ((flags & kInlineQos) && !read_parameters(body, [](std::uint16_t, Cursor) {}))
    return std::nullopt;
  if (!(flags & kPayload)) return std::nullopt;
  const unsigned char* encapsulation = body.skip(4);
  if (!encapsulation) return std::nullopt;
  Cursor list = body.part(body.left(), encapsulation[1] & 1);
  Announcement found;
  const bool is_whole = read_parameters(list, [&](std::uint16_t id, const Cursor& value) {
    if (id == kEntityName) found.name = read_string(value);
    if (id == kIdentityToken) found.is_secured = true;
  });
  return is_whole ? std::optional(found) : std::nullopt;
}

}  // namespace

std::optional<Announcement> parse_announcement(const unsigned char* message, std::size_t size) {
  if (size < kHeaderSize || std::memcmp(message, "RTPS", 4) != 0) return std::nullopt;
  Cursor rest(message + kHeaderSize, size - kHeaderSize, true);
  while (rest.left() >= kSubmessageHeaderSize) {
    const auto kind = static_cast<std::uint8_t>(rest.read(1));
    const auto flags = static_cast<std::uint8_t>(rest.read(1));
    const unsigned char* length = rest.skip(2);
    const bool is_little = flags & kLittleEndian;
    std::size_t count = is_little ? length[0] | length[1] << 8 : length[0] << 8 | length[1];
    if (count == 0) count = rest.left();  // length 0: up to the end of the message
    const Cursor body = rest.part(count, is_little);
    if (!rest.is_good()) return std::nullopt;
    if (kind != kDataSubmessage) continue;
    if (auto found = parse_data(body, flags)) {
      std::copy_n(message + kPrefixOffset, found->id.bytes.size(), found->id.bytes.begin());
      return found;
    }
  }
  return std::nullopt;
}

}  // namespace sls::doctor
