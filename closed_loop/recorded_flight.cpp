#include "closed_loop/recorded_flight.hpp"

#include <fmt/format.h>

#include <numeric>

#include "closed_loop/record_entries.hpp"
#include "common/app/options.hpp"
#include "common/app/stop_signal.hpp"
#include "recorder/recording.hpp"
#include "recorder/recording_folder.hpp"
#include "sim_server/messages.hpp"
#include "sim_server/status_board.hpp"

namespace sls::closed_loop {

FlightEnd fly_recorded(const config::Scenario& scenario, const FlightOptions& options,
                       const std::filesystem::path& folder, bool force) {
  std::vector<std::uint32_t> ids(scenario.vehicles.size());
  std::iota(ids.begin(), ids.end(), 0);
  const std::uint64_t run_id = sim::make_run_id();
  Flight flight(scenario, ids, options);
  record::prepare_recording_folder(folder, force);
  record::Recording recording(
      folder, sim::make_parameters_message(run_id, ids, scenario, flight.plant(), app::version()));
  sim::StatusBoard board([&](const SimStatus& status) { recording.add(status); }, run_id,
                         ids.front(), scenario.sync, [] { return SyncCounters(); });
  board.controller_name = options.controller_name;
  board.start_clock();
  board.publish(PHASE_RUNNING, "");
  RecordBatch batch;
  batch.run_id(run_id);
  const auto hand_on = [&] {
    recording.add(batch);
    batch.batch_index(batch.batch_index() + 1);
    batch.entries().clear();
  };
  while (app::stop_signal() == 0 && flight.fly_step()) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      fill_entry(batch.entries().emplace_back(), ids[i], flight.steps()[i], options.controller_name,
                 flight.is_refused(i));
      if (batch.entries().size() == BATCH_ENTRIES) hand_on();
    }
    board.step = flight.steps().front().step;
    if (board.step > 0)
      for (std::size_t i = 0; i < ids.size(); ++i) board.timing.add(FORCE_ANSWERED, 0);
    if (board.is_due()) {
      for (const std::string& remark : flight.take_remarks()) board.announce(remark);
      board.publish(PHASE_RUNNING, "");
    }
    recording.flush_if_due();
  }
  for (const std::string& remark : flight.take_remarks()) board.announce(remark);
  batch.is_last(true);
  hand_on();
  FlightEnd end{board.step, flight.failure(), false};
  if (app::stop_signal() != 0) {
    end.failure = "interrupted";
    recording.finish(end.failure, 0);
    return end;
  }
  board.publish(end.failure.empty() ? PHASE_FINISHED : PHASE_FAILED,
                end.failure.empty() ? "mission finished" : end.failure);
  end.is_complete = recording.finish("", 0);
  return end;
}

}  // namespace sls::closed_loop
