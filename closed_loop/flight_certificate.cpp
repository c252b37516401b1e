#include "closed_loop/flight_certificate.hpp"

#include "closed_loop/record_entries.hpp"

namespace sls::closed_loop {

FlightCertificate::FlightCertificate(std::int64_t period_ns, const sim::Plant& plant) {
  parameters_.period_ns(period_ns);
  parameters_.has_attitude(plant.has_attitude());
  parameters_.signals().resize(plant.signals().size());
}

void FlightCertificate::add(std::uint32_t vehicle_id, const FlownStep& flown, bool is_refused) {
  static const std::string kNobody;  // names are not certified
  fill_entry(entry_, vehicle_id, flown, kNobody, is_refused);
  record::fill_rows(rows_, entry_, parameters_);
  certificate_.add(rows_);
}

}  // namespace sls::closed_loop
