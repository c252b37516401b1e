/// Bytes in the making, whose memory is kept from one use to the next.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

namespace sls::record {

/// Numbers go in as little-endian bytes, texts after their length of 32 bits.
class ByteBuffer {
 public:
  std::string_view bytes() const { return {bytes_.data(), size_}; }
  void clear() { size_ = 0; }

  template <class Integer, std::enable_if_t<std::is_integral_v<Integer>, int> = 0>
  void append(Integer value) {
    char* place = extend(sizeof value);
    // Which compilers turn into one store.
    for (std::size_t i = 0; i < sizeof value; ++i) place[i] = static_cast<char>(value >> (8 * i));
  }

  void append(double number) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    // What "nan" and "-nan" in a file read back to.
    if (std::isnan(number)) bits = std::signbit(number) ? 0xfff8000000000000 : 0x7ff8000000000000;
    append(bits);
  }

  void append(std::string_view text) {
    append(static_cast<std::uint32_t>(text.size()));
    if (!text.empty()) std::memcpy(extend(text.size()), text.data(), text.size());
  }

 private:
  /// The begin of so many more bytes.
  char* extend(std::size_t size) {
    if (size_ + size > bytes_.size()) bytes_.resize(2 * (size_ + size));
    size_ += size;
    return bytes_.data() + size_ - size;
  }

  std::vector<char> bytes_;
  std::size_t size_ = 0;  // of those in use
};

}  // namespace sls::record
