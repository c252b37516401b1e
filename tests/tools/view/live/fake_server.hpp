/// A fake server on its own node: publishes the messages that the test gives it.
#pragma once

#include <string>
#include <vector>

#include "common/app/mailbox.hpp"
#include "common/bus/node.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::test {

inline const std::string kQosFile = SLS_SOURCE_DIR "/config/qos/default.xml";

/// Parameters of a run of a shipped scenario.
inline Parameters make_parameters(std::uint64_t run_id,
                                  const std::vector<std::uint32_t>& vehicles = {0},
                                  const std::string& scenario = "figure_eight") {
  Parameters parameters;
  parameters.run_id(run_id);
  parameters.contract_sha256(bus::kContractSha256);
  parameters.scenario_text(read_bytes(SLS_SOURCE_DIR "/config/scenarios/" + scenario + ".yaml"));
  parameters.period_ns(4'000'000);
  parameters.step_ns(1'000'000);
  for (const std::uint32_t id : vehicles) {
    VehicleParameters& vehicle = parameters.vehicles().emplace_back();
    vehicle.vehicle_id(id);
    vehicle.quad_mass_kg(1.5);
    vehicle.load_mass_kg(0.2);
    vehicle.rod_length_m(1);
  }
  return parameters;
}

/// One answered step. Quad x is the step, and load z is the vehicle's id.
inline RecordEntry make_entry(std::uint32_t vehicle_id, std::uint64_t step,
                              AnswerKind kind = AnswerKind::ANSWER_ACCEPTED) {
  RecordEntry entry;
  entry.vehicle_id(vehicle_id);
  entry.step(step);
  entry.kind(kind);
  entry.truth().p_WQ_m({static_cast<double>(step), 2, 3});
  entry.truth().q_WB({1, 0, 0, 0});
  entry.truth().p_WL_m({4, 5, static_cast<double>(vehicle_id)});
  entry.f_Q_W_n({0, 0, -16});
  entry.answer().vehicle_id(vehicle_id);
  entry.answer().reference().position_m({7, 8, 9});
  return entry;
}

/// Steps [first, last] of `vehicles`.
inline RecordBatch make_batch(std::uint64_t run_id, std::uint64_t first, std::uint64_t last,
                              const std::vector<std::uint32_t>& vehicles = {0}) {
  RecordBatch batch;
  batch.run_id(run_id);
  for (std::uint64_t step = first; step <= last; ++step)
    for (const std::uint32_t id : vehicles) batch.entries().push_back(make_entry(id, step));
  return batch;
}

class FakeServer {
 public:
  FakeServer(int domain, std::uint64_t run_id)
      : node_(kQosFile, domain, "fake server"),
        parameters_writer_(node_),
        status_writer_(node_),
        record_writer_(node_),
        state_writer_(node_),
        reply_writer_(node_),
        request_reader_(
            node_, bus::kLatchedReaderProfile,
            [this](const SimControl& request, const bus::PeerId&) { requests.put(request); }) {
    begin_run(make_parameters(run_id));
  }

  void begin_run(const Parameters& parameters) {
    run_id_ = parameters.run_id();
    samples_ = 0;
    parameters_writer_.write(parameters);
    publish(RunPhase::PHASE_WAITING, "waiting for: controller");
  }

  void publish(RunPhase phase, const std::string& reason = "", std::uint64_t step = 0) {
    SimStatus status;
    status.run_id(run_id_);
    status.sample_index(samples_++);
    status.phase(phase);
    status.reason(reason);
    status.step(step);
    status_writer_.write(status);
  }

  void write(const RecordBatch& batch) { record_writer_.write(batch); }
  void write(const States& states) { state_writer_.write(states); }

  void reply(const SimControl& request, bool is_accepted, const std::string& reason = "") {
    SimControlReply reply;
    reply.run_id(request.run_id());
    reply.vehicle_id(request.vehicle_id());
    reply.request_id(request.request_id());
    reply.accepted(is_accepted);
    reply.reason(reason);
    reply.step(12);
    reply_writer_.write(reply);
  }

  bool is_record_read_by(const bus::Node& node) const {
    return record_writer_.matched().count(node.id()) > 0;
  }
  bool is_state_read_by(const bus::Node& node) const {
    return state_writer_.matched().count(node.id()) > 0;
  }

  std::uint64_t run_id() const { return run_id_; }
  app::Mailbox<SimControl> requests{64};

 private:
  bus::Node node_;
  bus::Writer<Parameters> parameters_writer_;
  bus::Writer<SimStatus> status_writer_;
  bus::Writer<RecordBatch> record_writer_;
  bus::Writer<States> state_writer_;
  bus::Writer<SimControlReply> reply_writer_;
  std::uint64_t run_id_ = 0;
  std::uint64_t samples_ = 0;
  bus::Reader<SimControl> request_reader_;  // last: its handler uses the members above
};

}  // namespace sls::test
