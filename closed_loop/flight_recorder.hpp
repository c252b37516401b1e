/// The recording of a flight in one process, in the recorder's files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "closed_loop/flight.hpp"
#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "recorder/recording.hpp"
#include "sim_server/status_board.hpp"

namespace sls::closed_loop {

/// Takes the steps of a flight and writes what server, client and recorder of it would have left.
/// Every member @throws std::system_error naming the file when the disk refuses.
class FlightRecorder {
 public:
  /// Opens the files in `folder`, new or empty; with `force`, instead of the recording that is
  /// there. `parameters` are those that the flight's server would publish.
  /// @throws config::ConfigError for the folder.
  FlightRecorder(const std::filesystem::path& folder, bool force, const Parameters& parameters,
                 const config::Sync& sync, const std::string& controller_name);

  /// One step of all vehicles, in the order of the parameters; the answer of the `refused`th failed
  /// the flight.
  void add(const std::vector<FlownStep>& steps, std::optional<std::size_t> refused);

  /// Whether the next sample of the status is due, with which remarks are announced.
  bool is_status_due() const { return board_.is_due(); }
  void announce(const std::vector<std::string>& remarks);

  /// Ends the recording of a flight that ended by itself; `failure` is empty if its missions
  /// were finished. True if the recording is complete.
  bool finish(const std::string& failure);
  /// Ends that of a flight that was broken off.
  void interrupt(const std::string& reason);

  std::uint64_t last_step() const { return board_.step; }

 private:
  void hand_on();

  const std::string controller_name_;
  std::vector<std::uint32_t> ids_;
  record::Recording recording_;
  sim::StatusBoard board_;
  RecordBatch batch_;
};

}  // namespace sls::closed_loop
