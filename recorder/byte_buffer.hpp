/// A growing sequence of bytes, which keeps its memory when it is cleared.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

namespace sls::record {

/// Numbers are appended as little-endian bytes, texts after their length (32 bits). `make_room`
/// leaves room for `kRoom` bytes, so the few numbers of a row need no check.
class ByteBuffer {
 public:
  static constexpr std::size_t kRoom = 512;

  std::string_view bytes() const { return {bytes_.data(), size_}; }
  void clear() { size_ = 0; }

  /// Makes room for `size` bytes, and for `kRoom` after them.
  void make_room(std::size_t size) {
    if (size_ + size + kRoom > bytes_.size()) bytes_.resize(2 * (size_ + size + kRoom));
  }

  /// Does not check for room.
  template <class Integer, std::enable_if_t<std::is_integral_v<Integer>, int> = 0>
  void append(Integer value) {
    char* place = bytes_.data() + size_;
    // Compilers turn this loop into one store.
    for (std::size_t i = 0; i < sizeof value; ++i) place[i] = static_cast<char>(value >> (8 * i));
    size_ += sizeof value;
  }

  /// Does not check for room.
  void append(double number) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    // The values that result from reading "nan" and "-nan" in a file.
    if (std::isnan(number)) bits = std::signbit(number) ? 0xfff8000000000000 : 0x7ff8000000000000;
    append(bits);
  }

  void append(std::string_view text) {
    make_room(sizeof(std::uint32_t) + text.size());
    append(static_cast<std::uint32_t>(text.size()));
    append_raw(text);
  }

  /// Appends bytes of another buffer, without a length.
  void append_raw(std::string_view bytes) {
    make_room(bytes.size());
    if (!bytes.empty()) std::memcpy(bytes_.data() + size_, bytes.data(), bytes.size());
    size_ += bytes.size();
  }

  /// Overwrites appended bytes, from `place` on.
  template <class Integer>
  void replace(std::size_t place, Integer value) {
    const std::size_t size = size_;
    size_ = place;
    append(value);
    size_ = size;
  }

 private:
  std::vector<char> bytes_;
  std::size_t size_ = 0;  // number of used bytes
};

}  // namespace sls::record
