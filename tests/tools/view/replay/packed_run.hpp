/// Reads a packed recording with an independent parser, according to tools/view/replay/README.md.
#pragma once

#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace sls::view::test {

struct PackedRun {
  struct Vehicle {
    std::vector<double> times;
    std::vector<std::vector<float>> rows;
  };
  nlohmann::json head;
  std::map<std::uint32_t, Vehicle> vehicles;

  std::size_t find_column(const std::string& name) const {
    const auto& columns = head.at("run").at("columns");
    for (std::size_t i = 0; i < columns.size(); ++i)
      if (columns[i].at("name") == name) return i;
    throw std::runtime_error("no column " + name);
  }
};

inline PackedRun unpack(const std::string& bytes) {
  const auto take = [&](std::size_t at, std::size_t size) {
    if (at + size > bytes.size()) throw std::runtime_error("too short");
    return bytes.data() + at;
  };
  if (bytes.compare(0, 8, "SLSVIEW1") != 0) throw std::runtime_error("other magic");
  std::uint32_t size = 0;
  std::memcpy(&size, take(8, 4), 4);
  PackedRun run;
  run.head = nlohmann::json::parse(std::string(take(12, size), size));
  std::size_t at = 12 + size;
  if (at % 8 != 0) throw std::runtime_error("rows begin at " + std::to_string(at));
  const std::size_t columns = run.head.at("run").at("columns").size();
  for (const auto& vehicle : run.head.at("vehicles")) {
    const std::size_t rows = vehicle.at("rows");
    PackedRun::Vehicle& item = run.vehicles[vehicle.at("id")];
    item.times.resize(rows);
    std::memcpy(item.times.data(), take(at, 8 * rows), 8 * rows);
    at += 8 * rows;
    for (std::size_t i = 0; i < rows; ++i, at += 4 * columns) {
      item.rows.emplace_back(columns);
      std::memcpy(item.rows.back().data(), take(at, 4 * columns), 4 * columns);
    }
  }
  if (at != bytes.size()) throw std::runtime_error("too long");
  return run;
}

}  // namespace sls::view::test
