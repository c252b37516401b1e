#include "recorder/certificate.hpp"

#include <string_view>
#include <type_traits>

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
    if constexpr (std::is_same_v<Field, model::Numbers>)
      bytes.make_room(static_cast<std::size_t>(field.size()) * sizeof(double));
    for_each_component(field, [this](const auto& component) { bytes.append(component); });
  }
};

template <class Row>
void append_row(ByteBuffer& bytes, const StepRows& rows) {
  bytes.append(std::string_view(Row::kTopic));
  Collector collector{bytes};
  Row::visit(rows, collector);
}

}  // namespace

template <class Row>
std::string to_bytes(const StepRows& rows) {
  ByteBuffer bytes;
  append_row<Row>(bytes, rows);
  return std::string(bytes.bytes());
}
template std::string to_bytes<StateRow>(const StepRows&);
template std::string to_bytes<CommandRow>(const StepRows&);
template std::string to_bytes<ReferenceRow>(const StepRows&);

void Certificate::add(const StepRows& rows) {
  Vehicle& vehicle = vehicles_[rows.vehicle_id];
  if (rows.has_state) append_row<StateRow>(vehicle.bytes, rows);
  if (rows.has_command) append_row<CommandRow>(vehicle.bytes, rows);
  if (rows.has_reference) append_row<ReferenceRow>(vehicle.bytes, rows);
  if (vehicle.bytes.bytes().size() >= kHashedTogether) vehicle.hash_bytes();
}

void Certificate::Vehicle::hash_bytes() {
  hash.add(bytes.bytes());
  bytes.clear();
}

std::string Certificate::finish() {
  text::Sha256 flight;
  for (auto& [id, vehicle] : vehicles_) {
    vehicle.hash_bytes();
    vehicle.bytes.make_room(0);  // kRoom
    vehicle.bytes.append(id);
    flight.add(vehicle.bytes.bytes());
    const auto digest = vehicle.hash.finish();
    flight.add(digest.data(), digest.size());
  }
  return text::to_hex(flight.finish());
}

}  // namespace sls::record
