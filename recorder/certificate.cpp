#include "recorder/certificate.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace sls::record {
namespace {

template <class Integer, std::enable_if_t<std::is_integral_v<Integer>, int> = 0>
void append(std::string& bytes, Integer value) {
  std::array<char, sizeof value> little_endian;
  for (char& byte : little_endian) {
    byte = static_cast<char>(value & 0xff);
    value = static_cast<Integer>(value >> 8);
  }
  bytes.append(little_endian.data(), little_endian.size());
}

void append(std::string& bytes, std::string_view text) {
  append(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += text;
}

void append(std::string& bytes, double number) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &number, sizeof bits);
  // What "nan" and "-nan" in a file read back to.
  if (std::isnan(number)) bits = std::signbit(number) ? 0xfff8000000000000 : 0x7ff8000000000000;
  append(bytes, bits);
}

struct Collector {
  std::string& bytes;

  template <class Field>
  void operator()(const Column& column, const Field& field) {
    if (!column.is_certified) return;
    for_each_component(field, [this](const auto& component) { append(bytes, component); });
  }
};

template <class Row>
void append_row(std::string& bytes, const Row& row) {
  append(bytes, std::string_view(Row::kTopic));
  Collector collector{bytes};
  Row::visit(row, collector);
}

template <class Row>
std::string collect(const Row& row) {
  std::string bytes;
  append_row(bytes, row);
  return bytes;
}

}  // namespace

std::string to_bytes(const StateRow& row) { return collect(row); }
std::string to_bytes(const CommandRow& row) { return collect(row); }
std::string to_bytes(const ReferenceRow& row) { return collect(row); }

void Certificate::add(const StepRows& rows) {
  bytes_.clear();
  if (rows.state) append_row(bytes_, *rows.state);
  if (rows.command) append_row(bytes_, *rows.command);
  if (rows.reference) append_row(bytes_, *rows.reference);
  vehicles_[rows.vehicle_id].add(bytes_);
}

std::string Certificate::finish() {
  config::Sha256 flight;
  for (auto& [id, vehicle] : vehicles_) {
    std::string bytes;
    append(bytes, id);
    flight.add(bytes);
    const auto digest = vehicle.finish();
    flight.add(digest.data(), digest.size());
  }
  return config::to_hex(flight.finish());
}

}  // namespace sls::record
