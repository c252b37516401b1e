/// The certificate of a flight in one process, without its recording.
#pragma once

#include <string>

#include "common/model/step_record.hpp"
#include "recorder/certificate.hpp"
#include "recorder/rows.hpp"

namespace sls::closed_loop {

/// Equal to the certificate of the recording that fly_recorded makes of the same flight, because
/// both are made from the recorder's rows.
class FlightCertificate {
 public:
  explicit FlightCertificate(const record::RowFormat& format) : format_(format) {}

  /// Adds a step. The steps of each vehicle must come in order.
  void add(const model::StepRecord& step) {
    static_cast<model::StepRecord&>(rows_) = step;
    record::fill_columns(rows_, format_);
    certificate_.add(rows_);
  }

  /// 64 lower-case hex digits; nothing can be added after it.
  std::string finish() { return certificate_.finish(); }

 private:
  const record::RowFormat format_;
  record::StepRows rows_;  // its memory is used again for each step
  record::Certificate certificate_;
};

}  // namespace sls::closed_loop
