/// Refuses datagrams that make Fast DDS abort, hang or take gigabytes. Any host can send them, also
/// to a secured flight: Fast DDS reads these fields before it decrypts a message (README.md, trap
/// 46).
///
/// Upstream: none reported. To be deleted when Fast DDS checks these fields itself;
/// datagram_guard_test.cpp names the cases.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <set>
#include <string>

namespace sls::bus {

/// Longest sample of our types and of discovery, in bytes, with what encryption adds.
inline constexpr std::uint32_t kMostSampleBytes = 1 << 20;
/// Most samples that one message may call irrelevant: Fast DDS stores each.
inline constexpr std::int64_t kMostIrrelevant = 1 << 16;
/// Greatest number of a sample: 12 days at 1 kHz. Fast DDS counts up to the number that a message
/// names, one by one, with its reader locked.
inline constexpr std::int64_t kMostSequenceNumber = 1 << 30;

/// What Fast DDS may read of a datagram.
struct DatagramVerdict {
  const char* defect = nullptr;  ///< why nothing of it may be read; null if it may
  std::size_t bytes = 0;         ///< at the beginning; without the statistics at the end
};

/// Judges a datagram of `size` bytes.
DatagramVerdict judge_datagram(const std::uint8_t* data, std::size_t size);

/// Counts refused datagrams of this process and names each sender once.
class RefusedDatagrams {
 public:
  static constexpr std::size_t kMostSenders = 64;

  /// Returns true if the sender is to be named: it is new.
  bool note(const std::string& address);
  std::uint64_t count() const;

 private:
  mutable std::mutex mutex_;
  std::set<std::string> senders_;
  std::uint64_t count_ = 0;
};

}  // namespace sls::bus
