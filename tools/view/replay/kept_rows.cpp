#include "tools/view/replay/kept_rows.hpp"

#include <algorithm>

namespace sls::view {
namespace {

template <class Number>
void append(std::string& bytes, const std::vector<Number>& numbers) {
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the format is little-endian");
  bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
}

}  // namespace

KeptRows::KeptRows(const std::vector<std::uint32_t>& vehicle_ids, std::size_t columns,
                   std::size_t most_bytes)
    : columns_(columns),
      row_bytes_(sizeof(double) + columns * sizeof(float)),
      most_held_(3 * (most_bytes / row_bytes_)) {
  for (const std::uint32_t id : vehicle_ids) vehicles_[id];
}

void KeptRows::add(std::uint32_t vehicle_id, std::uint64_t step, double sim_time_s,
                   const std::vector<float>& row) {
  Vehicle& vehicle = vehicles_.at(vehicle_id);
  // The row added before is no longer the last. It stays only if its step is a multiple of every_.
  const std::size_t last = vehicle.steps.size() - 1;
  if (vehicle.steps.size() > 1 && vehicle.steps[last] % every_ != 0) {
    vehicle.steps.pop_back();
    vehicle.times.pop_back();
    vehicle.values.resize(vehicle.values.size() - columns_);
    --held_;
  }
  ++vehicle.rows_added;
  vehicle.steps.push_back(step);
  vehicle.times.push_back(sim_time_s);
  vehicle.values.insert(vehicle.values.end(), row.begin(), row.end());
  if (++held_ > most_held_ && held_ > 3 * vehicles_.size()) thin_out(2 * every_);
}

bool KeptRows::is_kept(const Vehicle& vehicle, std::size_t index, std::uint64_t every) const {
  return index == 0 || index + 1 == vehicle.steps.size() || vehicle.steps[index] % every == 0;
}

void KeptRows::thin_out(std::uint64_t every) {
  every_ = every;
  held_ = 0;
  for (auto& [id, vehicle] : vehicles_) {
    std::size_t kept = 0;
    const std::size_t rows = vehicle.steps.size();
    for (std::size_t index = 0; index < rows; ++index) {
      if (!is_kept(vehicle, index, every)) continue;
      vehicle.steps[kept] = vehicle.steps[index];
      vehicle.times[kept] = vehicle.times[index];
      std::copy_n(vehicle.values.begin() + static_cast<std::ptrdiff_t>(index * columns_), columns_,
                  vehicle.values.begin() + static_cast<std::ptrdiff_t>(kept * columns_));
      ++kept;
    }
    vehicle.steps.resize(kept);
    vehicle.times.resize(kept);
    vehicle.values.resize(kept * columns_);
    held_ += kept;
  }
}

std::size_t KeptRows::count_bytes(std::uint64_t every) const {
  std::size_t rows = 0;
  for (const auto& [id, vehicle] : vehicles_)
    for (std::size_t index = 0; index < vehicle.steps.size(); ++index)
      rows += is_kept(vehicle, index, every) ? 1 : 0;
  return rows * row_bytes_;
}

bool KeptRows::fit(std::size_t most_bytes) {
  std::uint64_t last_step = 0;
  for (const auto& [id, vehicle] : vehicles_)
    if (!vehicle.steps.empty()) last_step = std::max(last_step, vehicle.steps.back());
  const std::uint64_t most_times = last_step / every_ + 1;  // keeps only first and last
  std::uint64_t times = 1;
  while (count_bytes(times * every_) > most_bytes) {
    if (times == most_times) return false;
    // The rows held exceed the budget only a few times, so `times` passes 16 only if the steps of a
    // folder are not consecutive.
    times = std::min(times < 16 ? times + 1 : 2 * times, most_times);
  }
  if (times > 1) thin_out(times * every_);
  return true;
}

std::uint64_t KeptRows::steps_total() const {
  std::uint64_t most = 0;
  for (const auto& [id, vehicle] : vehicles_) most = std::max(most, vehicle.rows_added);
  return most;
}

double KeptRows::last_time_s() const {
  double last = 0;
  for (const auto& [id, vehicle] : vehicles_)
    if (!vehicle.times.empty()) last = std::max(last, vehicle.times.back());
  return last;
}

std::vector<std::uint32_t> KeptRows::vehicle_ids() const {
  std::vector<std::uint32_t> ids;
  for (const auto& [id, vehicle] : vehicles_) ids.push_back(id);
  return ids;
}

std::size_t KeptRows::count_rows(std::uint32_t vehicle_id) const {
  return vehicles_.at(vehicle_id).steps.size();
}

void KeptRows::append_to(std::string& bytes) const {
  for (const auto& [id, vehicle] : vehicles_) {
    append(bytes, vehicle.times);
    append(bytes, vehicle.values);
  }
}

}  // namespace sls::view
