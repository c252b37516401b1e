#include "recorder/columns.hpp"

#include "common/bus/convert.hpp"
#include "common/bus/names.hpp"
#include "common/bus/sync_counters.hpp"
#include "common/model/forces.hpp"

namespace sls::record {
namespace {

struct FieldWriter {
  CsvFile& file;

  template <class Field>
  void operator()(const Field& field) {
    file.add(field);
  }
  template <class Field>
  void incidental(const Field& field) {
    file.add(field);
  }
};

template <class Row>
void write_fields(CsvFile& file, const Row& row) {
  FieldWriter writer{file};
  Row::visit(row, writer);
  file.end_row();
}

double to_microseconds(std::uint64_t nanoseconds) { return static_cast<double>(nanoseconds) / 1e3; }

}  // namespace

void write_row(CsvFile& file, const StateRow& row) { write_fields(file, row); }
void write_row(CsvFile& file, const CommandRow& row) { write_fields(file, row); }
void write_row(CsvFile& file, const ReferenceRow& row) { write_fields(file, row); }

void write_row(CsvFile& file, const SimStatus& status) {
  file.add(status.sample_index());
  file.add(bus::to_string(status.phase()));
  file.add(status.reason().c_str());
  file.add(status.step());
  file.add(status.controller_name().c_str());
  file.add(status.real_time_factor());
  for (const bus::SyncCounter& counter : bus::kSyncCounters)
    file.add((status.counters().*counter.get)());
  file.add(to_microseconds(status.round_trip_p50_ns()));
  file.add(to_microseconds(status.round_trip_p99_ns()));
  file.add(status.timing().c_str());
  file.end_row();
}

std::string make_status_header() {
  std::string header = "sample_index,phase,reason,step,controller,real_time_factor,";
  for (const bus::SyncCounter& counter : bus::kSyncCounters)
    header += counter.name + std::string(",");
  return header + "round_trip_p50_us,round_trip_p99_us,timing";
}

std::string make_flight_header(bool is_of_fleet) {
  return std::string(kFlightHeader) + (is_of_fleet ? ",vehicle_id" : "");
}

void write_flight_row(CsvFile& file, const StateRow& state, const CommandRow& command,
                      const ReferenceRow& reference, bool is_of_fleet) {
  const Eigen::Vector3d f_Q_W = bus::to_vector(command.f_Q_W);
  const model::CommandedAttitude attitude = model::calc_commanded_attitude(f_Q_W);
  const Eigen::Vector3d n_W =
      (bus::to_vector(state.p_WL) - bus::to_vector(state.p_WQ)).normalized();
  file.add(state.sim_time_s);
  file.add_all(reference.position());
  file.add_all(state.p_WQ);
  file.add(attitude.roll);
  file.add(attitude.pitch);
  file.add(attitude.yaw);
  file.add_all(state.v_WQ);
  file.add_all(n_W);
  file.add(state.alpha);
  file.add(state.beta);
  file.add(state.alpha_dot);
  file.add(state.beta_dot);
  file.add_all(f_Q_W);
  if (is_of_fleet) file.add(state.vehicle_id);
  file.end_row();
}

}  // namespace sls::record
