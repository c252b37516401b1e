/// Mirrors a made-up flight of the vehicles 0 and 3 for tests with other libraries. It prints lines
/// of JSON: the channels, then each sample (frame W, z down) and its messages (CDR in hexadecimal).
#include <Eigen/Geometry>
#include <iostream>
#include <nlohmann/json.hpp>

#include "tests/common/ros/made_up_flight.hpp"

namespace {

using nlohmann::json;

std::string to_hex(const std::vector<std::uint8_t>& bytes) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

json to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

json to_json(const sls::ros::VehicleSample& sample) {
  const Eigen::Quaterniond& q = sample.q_WB;
  return {{"vehicle_id", sample.vehicle_id},
          {"step", sample.step},
          {"sim_time_ns", sample.sim_time_ns},
          {"p_WQ", to_json(sample.p_WQ)},
          {"v_WQ", to_json(sample.v_WQ)},
          {"q_WB", {q.w(), q.x(), q.y(), q.z()}},
          {"w_WB_B", to_json(sample.w_WB_B)},
          {"p_WL", to_json(sample.p_WL)},
          {"v_WL", to_json(sample.v_WL)},
          {"reference", sample.reference ? to_json(*sample.reference) : json()}};
}

}  // namespace

int main() {
  sls::ros::Mirrors mirrors(sls::test::kMadeUpVehicles);
  for (const sls::ros::Channel& channel : mirrors.channels())
    std::cout << json{{"topic", channel.topic},
                      {"type", channel.type},
                      {"schema", channel.schema},
                      {"type_hash", channel.type_hash},
                      {"is_latched", channel.is_latched}}
              << '\n';
  const auto print = [](std::size_t channel, std::int64_t time_ns, const auto& cdr) {
    std::cout << json{{"channel", channel}, {"sim_time_ns", time_ns}, {"cdr", to_hex(cdr)}} << '\n';
  };
  mirrors.emit_static(print);
  for (std::uint64_t step = 0; step < 1000; ++step)
    for (const std::uint32_t vehicle_id : sls::test::kMadeUpVehicles) {
      const auto sample = sls::test::make_sample(vehicle_id, step);
      std::cout << json{{"sample", to_json(sample)}} << '\n';
      mirrors.emit(sample, print);
    }
}
