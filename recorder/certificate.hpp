/// The certificate of a flight: one hash of all recorded data that is a pure function of the
/// scenario. Definition: README.md.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/text/sha256.hpp"
#include "recorder/byte_buffer.hpp"
#include "recorder/rows.hpp"

namespace sls::record {

/// The certified fields of a row as little-endian bytes. Two rows are equal if their bytes are
/// equal. For StateRow, CommandRow and ReferenceRow.
template <class Row>
std::string to_bytes(const StepRows& rows);

class Certificate {
 public:
  /// Adds the rows of a step. The steps of each vehicle must come in order.
  void add(const StepRows& rows);

  /// 64 lower-case hex digits; nothing can be added after it.
  std::string finish();

 private:
  struct Vehicle {
    void hash_bytes();

    text::Sha256 hash;
    ByteBuffer bytes;  // not hashed yet
  };

  std::map<std::uint32_t, Vehicle> vehicles_;
};

}  // namespace sls::record
