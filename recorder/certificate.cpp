#include "recorder/certificate.hpp"

#include <string_view>
#include <type_traits>
#include <vector>

namespace sls::record {
namespace {

/// Bytes that are hashed in one call: a call for each row would cost as much as the hash itself.
constexpr std::size_t kHashedTogether = 4096;

struct Collector {
  ByteBuffer& bytes;

  template <class Field>
  void operator()(const Column& column, const Field& field) {
    if (!column.is_certified) return;
    // A sequence has any length; for the other numbers of a row there is room.
    if constexpr (std::is_same_v<Field, std::vector<double>>)
      bytes.make_room(field.size() * sizeof(double));
    for_each_component(field, [this](const auto& component) { bytes.append(component); });
  }
};

template <class Row>
void append_row(ByteBuffer& bytes, const Row& row) {
  bytes.append(std::string_view(Row::kTopic));
  Collector collector{bytes};
  Row::visit(row, collector);
}

template <class Row>
std::string collect(const Row& row) {
  ByteBuffer bytes;
  append_row(bytes, row);
  return std::string(bytes.bytes());
}

}  // namespace

std::string to_bytes(const StateRow& row) { return collect(row); }
std::string to_bytes(const CommandRow& row) { return collect(row); }
std::string to_bytes(const ReferenceRow& row) { return collect(row); }

void Certificate::add(const StepRows& rows) {
  Vehicle& vehicle = vehicles_[rows.vehicle_id];
  if (rows.state) append_row(vehicle.bytes, *rows.state);
  if (rows.command) append_row(vehicle.bytes, *rows.command);
  if (rows.reference) append_row(vehicle.bytes, *rows.reference);
  if (vehicle.bytes.bytes().size() >= kHashedTogether) vehicle.hash_bytes();
}

void Certificate::Vehicle::hash_bytes() {
  hash.add(bytes.bytes());
  bytes.clear();
}

std::string Certificate::finish() {
  config::Sha256 flight;
  for (auto& [id, vehicle] : vehicles_) {
    vehicle.hash_bytes();
    vehicle.bytes.make_room(0);  // kRoom
    vehicle.bytes.append(id);
    flight.add(vehicle.bytes.bytes());
    const auto digest = vehicle.hash.finish();
    flight.add(digest.data(), digest.size());
  }
  return config::to_hex(flight.finish());
}

}  // namespace sls::record
