/// The certificate of a flight in one process, without its recording.
#pragma once

#include <cstdint>
#include <string>

#include "closed_loop/flight.hpp"
#include "common/bus/topics.hpp"
#include "recorder/certificate.hpp"
#include "recorder/rows.hpp"

namespace sls::closed_loop {

/// That of the recording which fly_recorded leaves of the same flight: made of the recorder's own
/// rows.
class FlightCertificate {
 public:
  /// Of vehicles that are moved by `plant` or ones like it, with the period in force.
  FlightCertificate(std::int64_t period_ns, const sim::Plant& plant);
  /// Of the flight that a server announces with `parameters`.
  explicit FlightCertificate(const Parameters& parameters) : parameters_(parameters) {}

  /// Adds what was flown of a step; of one vehicle in step order.
  void add(std::uint32_t vehicle_id, const FlownStep& flown, bool is_refused);

  /// 64 lower-case hex digits; nothing can be added after it.
  std::string finish() { return certificate_.finish(); }

 private:
  Parameters parameters_;  // as far as rows depend on them
  RecordEntry entry_;      // both used again and again, to keep their memory
  record::StepRows rows_;
  record::Certificate certificate_;
};

}  // namespace sls::closed_loop
