#include "common/bus/fastdds/plain_announcements.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>

namespace sls::bus {
namespace {

constexpr std::size_t kHeader = 20, kPrefix = 8, kPrefixSize = 12;
constexpr std::array<std::uint8_t, 4> kPlainWriter = {0, 1, 0, 0xc2};
constexpr std::array<std::uint8_t, 4> kSecureWriter = {0xff, 1, 1, 0xc2};
constexpr std::array<std::uint8_t, 4> kSecureReader = {0xff, 1, 1, 0xc7};
constexpr std::uint8_t kData = 0x15, kGap = 0x08;
constexpr std::uint8_t kLittleEndian = 1, kInlineQos = 2, kSample = 4;
constexpr std::uint16_t kSentinel = 0x0001, kProperties = 0x0059, kEntityName = 0x0062,
                        kIdentityToken = 0x1001;

/// A part of a message. The bytes beyond its end read as zeros and end it.
class Bytes {
 public:
  Bytes(const std::uint8_t* begin, std::size_t size, bool is_little)
      : at_(begin), left_(size), is_little_(is_little) {}

  const std::uint8_t* at() const { return at_; }
  std::size_t left() const { return left_; }
  bool is_short() const { return is_short_; }

  void skip(std::size_t size) {
    is_short_ = is_short_ || size > left_;
    size = std::min(size, left_);
    at_ += size, left_ -= size;
  }
  Bytes take(std::size_t size) {
    const Bytes part(at_, std::min(size, left_), is_little_);
    skip(size);
    return part;
  }
  std::uint32_t read(std::size_t size) {
    std::uint32_t value = 0;
    if (size <= left_)
      for (std::size_t i = 0; i < size; ++i)
        value = value << 8 | at_[is_little_ ? size - 1 - i : i];
    skip(size);
    return value;
  }
  /// A string of CDR, with the bytes that align what follows.
  std::string read_string() {
    const std::uint32_t size = read(4);
    const Bytes text = take(size);
    skip(std::min<std::size_t>((4 - size % 4) % 4, left_));
    return {text.at(), std::find(text.at(), text.at() + text.left(), 0)};
  }

 private:
  const std::uint8_t* at_;
  std::size_t left_;
  bool is_little_;
  bool is_short_ = false;
};

/// Calls `use` with the id and the value of each parameter, up to the sentinel. False if it lacks.
template <class Use>
bool read_parameters(Bytes& list, const Use& use) {
  while (!list.is_short()) {
    const auto id = static_cast<std::uint16_t>(list.read(2));
    const std::size_t size = list.read(2);
    if (id == kSentinel) return !list.is_short();
    use(id, list.take(size));
  }
  return false;
}

/// Says that the secure writer has no samples before `sequence_number`, so that the reader does not
/// wait for them.
std::vector<std::uint8_t> make_gap(std::uint32_t high, std::uint32_t low) {
  std::vector<std::uint8_t> gap = {kGap, kLittleEndian, 28, 0};
  gap.insert(gap.end(), kSecureReader.begin(), kSecureReader.end());
  gap.insert(gap.end(), kSecureWriter.begin(), kSecureWriter.end());
  for (const std::uint32_t value : {0u, 1u, high, low, 0u})
    for (int shift = 0; shift < 32; shift += 8)
      gap.push_back(static_cast<std::uint8_t>(value >> shift));
  return gap;
}

}  // namespace

std::optional<PlainAnnouncement> find_announcement(const std::uint8_t* message, std::size_t size) {
  constexpr std::array<std::uint8_t, 4> kMagic = {'R', 'T', 'P', 'S'};
  if (size < kHeader || !std::equal(kMagic.begin(), kMagic.end(), message)) return {};
  const bool is_of_cyclone = message[6] == 1 && message[7] == 16;
  Bytes rest(message, size, true);
  rest.skip(kHeader);
  while (rest.left() >= 4) {
    const std::uint8_t kind = rest.at()[0], flags = rest.at()[1];
    Bytes submessage(rest.at(), rest.left(), (flags & kLittleEndian) != 0);
    submessage.skip(2);
    const std::size_t length = submessage.read(2);
    if (kind != kData) {
      rest.skip(4 + length);
      continue;
    }
    if (length > 0) submessage = submessage.take(length);
    submessage.skip(2);
    const std::size_t to_qos = submessage.read(2);
    Bytes sample = submessage;
    sample.skip(to_qos);
    const std::uint8_t* ids = submessage.at();  // of reader and writer
    submessage.skip(8);
    const std::uint32_t high = submessage.read(4), low = submessage.read(4);
    if (submessage.is_short() || !std::equal(kPlainWriter.begin(), kPlainWriter.end(), ids + 4))
      return {};

    PlainAnnouncement found;
    if ((flags & kInlineQos) && !read_parameters(sample, [](auto...) {})) return {};
    if (flags & kSample) {
      const bool is_little = sample.left() > 1 && (sample.at()[1] & 1) != 0;
      Bytes list(sample.at(), sample.left(), is_little);
      list.skip(4);
      const bool is_whole = read_parameters(list, [&](std::uint16_t id, Bytes value) {
        if (id == kIdentityToken) found.is_secured = true;
        if (id == kEntityName) found.name = value.read_string();
        if (id != kProperties) return;
        for (std::uint32_t count = value.read(4); count > 0 && !value.is_short(); --count) {
          const std::string key = value.read_string(), text = value.read_string();
          if (key == "sls.fastdds") found.version = text;
          if (key == "sls.process") found.process = text;
          if (key == "sls.certificate") found.certificate = text;
          if (key == "sls.authority") found.authority = text;
        }
      });
      if (!is_whole) return {};
    }
    found.is_leaving = (flags & kSample) == 0;
    std::copy_n(message + kPrefix, kPrefixSize, found.sender.bytes.begin());
    if (!is_of_cyclone) return found;
    auto& copy = found.as_secure;
    copy.assign(message, message + size);
    const auto at = copy.begin() + (ids - message);
    std::copy(kSecureReader.begin(), kSecureReader.end(), at);
    std::copy(kSecureWriter.begin(), kSecureWriter.end(), at + 4);
    if (high > 0 || low > 1) {
      const auto gap = make_gap(high, low);
      copy.insert(copy.begin() + kHeader, gap.begin(), gap.end());
    }
    return found;
  }
  return {};
}

bool has_secure_announcements(const std::string& version) {
  int major = 0, minor = 0, patch = 0;
  std::sscanf(version.c_str(), "%d.%d.%d", &major, &minor, &patch);
  if (major != 2 || minor > 12) return major >= 2;
  return minor >= 10 && patch >= (minor == 12 ? 2 : 3);  // its last releases got it, too
}

}  // namespace sls::bus
