/// The certificate of a flight: one hash of everything about it that is a pure function of its
/// scenario (README.md has its definition).
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/config/sha256.hpp"
#include "recorder/byte_buffer.hpp"
#include "recorder/rows.hpp"

namespace sls::record {

/// A row's fields as little-endian bytes, those that are not certified left out. Two rows are equal
/// where their bytes are.
std::string to_bytes(const StateRow& row);
std::string to_bytes(const CommandRow& row);
std::string to_bytes(const ReferenceRow& row);

class Certificate {
 public:
  /// Adds what there is of a step; of one vehicle in step order.
  void add(const StepRows& rows);

  /// 64 lower-case hex digits; nothing can be added after it.
  std::string finish();

 private:
  struct Vehicle {
    void hash_bytes();

    config::Sha256 hash;
    ByteBuffer bytes;  // that are not hashed yet
  };

  std::map<std::uint32_t, Vehicle> vehicles_;
};

}  // namespace sls::record
