/// The state of one vehicle in sls/record, for the mirrors of common/ros.
#pragma once

#include "common/bus/convert.hpp"
#include "common/ros/mirrors.hpp"

namespace sls::view {

inline ros::VehicleSample make_vehicle_sample(const RecordEntry& entry, std::int64_t sim_time_ns) {
  const model::Measurement truth = bus::to_measurement(entry.truth());
  ros::VehicleSample sample;
  sample.vehicle_id = entry.vehicle_id();
  sample.step = entry.step();
  sample.sim_time_ns = sim_time_ns;
  sample.p_WQ = truth.p_WQ;
  sample.v_WQ = truth.v_WQ;
  sample.q_WB = truth.attitude.q_WB;
  sample.w_WB_B = truth.attitude.w_WB_B;
  sample.p_WL = truth.p_WL;
  sample.v_WL = truth.v_WL;
  sample.signals = entry.truth().signals();
  // The reference of an older answer belongs to an older step.
  if (entry.kind() == AnswerKind::ANSWER_ACCEPTED)
    sample.reference = bus::to_vector(entry.answer().reference().position_m());
  return sample;
}

}  // namespace sls::view
