#include "tools/view/foxglove/sample_stamp.hpp"

#include <limits>

namespace sls::view::foxglove {

namespace {

/// Reads numbers of a CDR sample. Offsets count from the end of the encapsulation header (4 bytes).
class Bytes {
 public:
  explicit Bytes(const std::vector<std::uint8_t>& cdr) : cdr_(cdr) {}

  bool is_plain() const { return cdr_.size() >= kHeader && cdr_[0] == 0 && cdr_[1] <= 1; }

  template <class Number>
  std::optional<Number> read(std::size_t at) const {
    if (at > cdr_.size() || cdr_.size() - at < kHeader + sizeof(Number)) return std::nullopt;
    const bool is_little_endian = cdr_[1] == 1;
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
      const std::size_t shift = is_little_endian ? i : sizeof(Number) - 1 - i;
      number |= static_cast<std::uint64_t>(cdr_[kHeader + at + i]) << (8 * shift);
    }
    return static_cast<Number>(number);
  }

  /// The 64-bit number that follows the string at `at`.
  std::optional<std::uint64_t> read_behind_string(std::size_t at) const {
    const auto length = read<std::uint32_t>(at);
    if (!length) return std::nullopt;
    const std::size_t end = at + 4 + *length;
    return read<std::uint64_t>((end + 7) / 8 * 8);
  }

 private:
  static constexpr std::size_t kHeader = 4;
  const std::vector<std::uint8_t>& cdr_;
};

// Offsets follow idl/sls.idl, whose types are @final: each number at a multiple of its size.
std::optional<std::uint64_t> find_step(TopicId topic, const Bytes& bytes) {
  switch (topic) {
    case TopicId::kState:
    case TopicId::kCommand:
      return bytes.read<std::uint64_t>(8);
    case TopicId::kRecord:  // run_id, batch_index, is_last, length, then an entry's id and step
      return bytes.read<std::uint32_t>(20).value_or(0) > 0 ? bytes.read<std::uint64_t>(32)
                                                           : std::nullopt;
    case TopicId::kStatus:        // run_id, vehicle_id, sample_index, phase, reason, step
    case TopicId::kControlReply:  // run_id, vehicle_id, request_id, accepted, reason, step
      return bytes.read_behind_string(28);
    case TopicId::kParticipant:
    case TopicId::kParameters:
    case TopicId::kControl:
      break;
  }
  return std::nullopt;
}

}  // namespace

std::optional<SampleStamp> read_stamp(TopicId topic, const std::vector<std::uint8_t>& cdr) {
  const Bytes bytes(cdr);
  if (!bytes.is_plain()) return std::nullopt;
  const auto run_id = bytes.read<std::uint64_t>(0);
  if (!run_id) return std::nullopt;
  SampleStamp stamp;
  stamp.run_id = *run_id;
  stamp.step = find_step(topic, bytes);
  if (topic == TopicId::kState) stamp.sim_time_ns = bytes.read<std::int64_t>(16);
  return stamp;
}

std::int64_t calc_sim_time(std::uint64_t step, std::int64_t period_ns) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max() * 1'000'000'000LL;
  if (period_ns <= 0) return 0;
  return step > static_cast<std::uint64_t>(kMost / period_ns)
             ? kMost
             : static_cast<std::int64_t>(step) * period_ns;
}

}  // namespace sls::view::foxglove
