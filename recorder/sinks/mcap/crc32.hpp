#pragma once

#include <cstdint>
#include <string_view>

namespace sls::record {

/// CRC-32 of ISO 3309, as zlib and MCAP have it, of bytes that come in pieces.
class Crc32 {
 public:
  void add(std::string_view bytes);
  /// Of all bytes so far; 0 of none.
  std::uint32_t value() const { return ~state_; }

 private:
  std::uint32_t state_ = 0xffffffff;
};

std::uint32_t calc_crc32(std::string_view bytes);

}  // namespace sls::record
