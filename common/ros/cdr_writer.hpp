/// Writes plain CDR (XCDR1), little-endian, into a buffer that is reused for the next message.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

namespace sls::ros {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are written as they lie here");

class CdrWriter {
 public:
  CdrWriter() { bytes_.reserve(16 * 1024); }

  /// Begins a message: the encapsulation header of little-endian plain CDR.
  void begin() { bytes_.assign({0, 1, 0, 0}); }

  template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
  void write(Number number) {
    std::memcpy(extend(sizeof(Number), sizeof(Number)), &number, sizeof(Number));
  }
  void write(bool flag) { *extend(1, 1) = flag ? 1 : 0; }
  void write(std::string_view text) {
    write(static_cast<std::uint32_t>(text.size() + 1));
    std::copy(text.begin(), text.end(), extend(text.size() + 1, 1));  // the rest is 0
  }
  void write_zeros(std::size_t doubles) { extend(doubles * sizeof(double), sizeof(double)); }

  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  /// Appends `size` zero bytes at a multiple of `alignment` behind the encapsulation header.
  std::uint8_t* extend(std::size_t size, std::size_t alignment) {
    constexpr std::size_t kHeader = 4;
    const std::size_t at =
        kHeader + (bytes_.size() - kHeader + alignment - 1) / alignment * alignment;
    bytes_.resize(at + size);
    return bytes_.data() + at;
  }

  std::vector<std::uint8_t> bytes_;
};

}  // namespace sls::ros
