#pragma once

#include <cstdint>
#include <string_view>

namespace sls::record {

/// CRC-32 of ISO 3309, as in zlib and MCAP, for bytes that are added in parts.
class Crc32 {
 public:
  void add(std::string_view bytes);
  /// The CRC of all bytes so far; 0 without bytes.
  std::uint32_t value() const { return ~state_; }

 private:
  std::uint32_t state_ = 0xffffffff;
};

std::uint32_t calc_crc32(std::string_view bytes);

}  // namespace sls::record
