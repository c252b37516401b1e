#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "closed_loop/flight_certificate.hpp"
#include "sim_server/core/server_core.hpp"
#include "sim_server/record_stream.hpp"
#include "sim_server/state_stream.hpp"
#include "worlds/program.hpp"

namespace sls::worlds {

/// A server: ServerCore with a simulated shell (sim_server/core_loop.hpp, outbox.hpp,
/// domain_view.hpp and record_stream.hpp are the real one).
class ServerProgram : public Program, private sim::Outputs, private sim::Surroundings {
 public:
  ServerProgram(Setting& setting, Host& host, std::string name,
                std::vector<std::uint32_t> vehicle_ids);
  void start() override;
  std::uint64_t run_id() const { return core_ ? core_->run_id() : 0; }
  /// The middleware refuses samples of reliable topics.
  void refuse_writes(bool is_refused) { is_refused_ = is_refused; }
  bool has_been_refused() const { return has_been_refused_; }
  /// The thread that writes sls/record waits for the middleware.
  void block_records(bool is_blocked);

 private:
  /// Flights of worlds are short.
  static constexpr std::size_t kRoomOfBlocked = 128;
  struct EndRecords {};
  using Item = std::variant<SimStatus, SimControlReply, sync::Line, EndRecords>;
  using Event = std::variant<sim::CommandSample, SimControl>;

  void wake() override;
  void begin_run(sim::ServerCore::Start start);
  void on_commands(const Commands& sample, const Peer::Arrival& arrival);
  void deliver_events();
  void take_up(const SimControl& request);
  void write_waiting();
  void write_records(bool is_last);
  /// A write that a run needs was refused. As CoreLoop and Server do.
  void fail_refused();
  void end_run();
  void linger();
  bool is_realtime() const {
    return setting_.flown->scenario.sync.mode == config::SyncMode::kRealtime;
  }

  // Outputs
  sim::Moment send_states(const sim::Fleet& fleet) override;
  void resend_states(const sim::Fleet& fleet,
                     const std::function<bool(std::size_t)>& is_wanted) override;
  void record_step(const sim::Fleet& fleet) override;
  void record_late(const sim::Vehicle& vehicle, const sim::OfferedAnswer& answer) override;
  bool is_record_full() const override {
    return batches_->count() >
           (is_blocked_ ? kRoomOfBlocked : sim::RecordStream::kMostCollected) / 2;
  }
  std::uint64_t lost() const override { return lost_; }
  void flush_records() override { write_records(false); }
  void end_records() override { outbox_.push_back(EndRecords()); }
  void send(const SimStatus& status) override { outbox_.push_back(status); }
  void send(const SimControlReply& reply) override { outbox_.push_back(reply); }
  void log(sync::Line line) override { outbox_.push_back(std::move(line)); }
  void show_progress(std::string) override {}
  void begin_flight() override {}
  void ignore_lifespan(bool is_ignored) override {
    peer_.ignore_lifespan(TopicId::kCommand, is_ignored);
  }

  // Surroundings
  std::uint64_t members_version() const override { return members_.version(); }
  std::vector<sync::Member> find_members(ParticipantRole role, std::uint64_t run_id) const override;
  std::vector<sync::Run> find_other_runs() const override;
  bool is_known_elsewhere(std::uint64_t run_id) const override;
  bool stays_on_this_machine() const override { return setting_.is_one_machine; }
  bool has_heard_every_claim() const override;
  std::uint64_t problems_version() const override { return 0; }
  sim::Neighbourhood find_neighbours() override;
  std::string replace_problems(const std::map<std::string, std::string>& found) override;
  std::string describe_isolation() const override { return ""; }
  Queues queues() const override;
  std::optional<std::chrono::nanoseconds> command_lifespan() const override;
  std::string stop_signal() const override { return stop_signal_; }

  ServerProgram& self() const { return const_cast<ServerProgram&>(*this); }

  const Process& sender(const Peer::Arrival& arrival) const {
    return setting_.network.find(arrival.sender)->process();
  }

  const std::vector<std::uint32_t> vehicle_ids_;
  FlightWatch* flight_ = nullptr;  // of the run
  std::unique_ptr<sim::ServerCore> core_;
  std::vector<Event> events_;
  std::deque<Item> outbox_;
  sim::StateSamples states_;
  std::optional<sim::RecordBatches> batches_;
  std::uint64_t next_batch_ = 0;
  std::size_t steps_ = 0;  // of the entries of batches_
  std::uint64_t written_ = 0, lost_ = 0;
  bool is_refused_ = false, has_been_refused_ = false, is_blocked_ = false;
  std::uint64_t flush_number_ = 0;
  std::optional<sim::Leaving> leaving_;
  std::optional<closed_loop::FlightCertificate> certificate_;
};

}  // namespace sls::worlds
