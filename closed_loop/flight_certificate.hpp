/// The certificate of a flight in one process, without its recording.
#pragma once

#include <cstdint>
#include <string>

#include "closed_loop/flight.hpp"
#include "common/bus/topics.hpp"
#include "recorder/certificate.hpp"
#include "recorder/rows.hpp"

namespace sls::closed_loop {

/// Equal to the certificate of the recording that fly_recorded makes of the same flight, because
/// both are made from the recorder's rows.
class FlightCertificate {
 public:
  /// For vehicles with `plant` or equal plants, and with the period in force.
  FlightCertificate(std::int64_t period_ns, const sim::Plant& plant);
  /// For the flight that a server announces with `parameters`.
  explicit FlightCertificate(const Parameters& parameters) : parameters_(parameters) {}

  /// Adds a step. The steps of each vehicle must come in order.
  void add(std::uint32_t vehicle_id, const FlownStep& flown, bool is_refused);

  /// 64 lower-case hex digits; nothing can be added after it.
  std::string finish() { return certificate_.finish(); }

 private:
  Parameters parameters_;  // only the members on which rows depend
  RecordEntry entry_;      // reused like rows_, to avoid allocation
  record::StepRows rows_;
  record::Certificate certificate_;
};

}  // namespace sls::closed_loop
