/// Reads the page's binary messages according to tools/view/README.md, without code of the viewer.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace sls::test {

class BinaryReader {
 public:
  explicit BinaryReader(std::string_view bytes) : bytes_(bytes) {}
  template <class Number>
  Number read() {
    if (bytes_.size() < sizeof(Number)) throw std::runtime_error("the message is too short");
    Number number;
    std::memcpy(&number, bytes_.data(), sizeof(Number));
    bytes_.remove_prefix(sizeof(Number));
    return number;
  }
  template <class Number>
  std::vector<Number> read_many(std::size_t count) {
    std::vector<Number> numbers;
    for (std::size_t i = 0; i < count; ++i) numbers.push_back(read<Number>());
    return numbers;
  }
  bool is_at_end() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
};

struct PoseOfVehicle {
  std::uint32_t vehicle_id = 0;
  std::uint32_t kind = 0;
  std::vector<float> quad, attitude, load, reference;
  float rotor_rate = 0;
  std::vector<float> cable;  ///< tension, length, taut, attitude of the load, released
};

struct Poses {
  std::uint64_t run_id = 0;
  std::uint64_t step = 0;
  double sim_time_s = 0;
  double published_ms = 0;
  std::vector<PoseOfVehicle> vehicles;
};

struct RowsMessage {
  std::uint32_t vehicle_id = 0;
  std::uint64_t run_id = 0;
  std::vector<double> times;
  std::vector<std::vector<float>> rows;
};

inline std::uint32_t find_kind(std::string_view message) {
  return BinaryReader(message).read<std::uint32_t>();
}

inline Poses read_poses(std::string_view message, bool has_cables = false) {
  BinaryReader reader(message);
  if (reader.read<std::uint32_t>() != 1) throw std::runtime_error("no poses");
  Poses poses;
  const auto count = reader.read<std::uint32_t>();
  poses.run_id = reader.read<std::uint64_t>();
  poses.step = reader.read<std::uint64_t>();
  poses.sim_time_s = reader.read<double>();
  poses.published_ms = reader.read<double>();
  for (std::uint32_t i = 0; i < count; ++i) {
    PoseOfVehicle& pose = poses.vehicles.emplace_back();
    pose.vehicle_id = reader.read<std::uint32_t>();
    pose.kind = reader.read<std::uint32_t>();
    pose.quad = reader.read_many<float>(3);
    pose.attitude = reader.read_many<float>(4);
    pose.load = reader.read_many<float>(3);
    pose.reference = reader.read_many<float>(3);
    pose.rotor_rate = reader.read<float>();
    if (has_cables) pose.cable = reader.read_many<float>(8);
  }
  if (!reader.is_at_end()) throw std::runtime_error("bytes left over");
  return poses;
}

inline RowsMessage read_rows(std::string_view message) {
  BinaryReader reader(message);
  if (reader.read<std::uint32_t>() != 2) throw std::runtime_error("no rows");
  RowsMessage rows;
  rows.vehicle_id = reader.read<std::uint32_t>();
  const auto count = reader.read<std::uint32_t>();
  const auto columns = reader.read<std::uint32_t>();
  rows.run_id = reader.read<std::uint64_t>();
  rows.times = reader.read_many<double>(count);
  for (std::uint32_t i = 0; i < count; ++i) rows.rows.push_back(reader.read_many<float>(columns));
  if (!reader.is_at_end()) throw std::runtime_error("bytes left over");
  return rows;
}

}  // namespace sls::test
