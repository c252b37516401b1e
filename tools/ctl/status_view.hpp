/// A run as lines of text. Pure: no network, no terminal, no clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"

namespace sls::ctl {

/// The data of a run at one moment.
struct Snapshot {
  Parameters parameters;
  std::uint32_t vehicle_id = 0;
  std::optional<SimStatus> status;
  std::vector<Participant> participants;
  std::vector<std::string> events;  ///< the last reasons that were published, oldest first
  double silence_s = 0.0;           ///< wall time since the last status, published every 0.5 s
  bool server_is_gone = false;
};

/// A longer silence is shown. The server publishes every 0.5 s.
inline constexpr double kLongSilence = 1.0;  // s

/// True if no more status will come: finished or failed. A reset run has a successor.
bool has_ended(const std::optional<SimStatus>& status);

/// The whole snapshot as lines to read; no line is longer than `columns` characters.
std::vector<std::string> render(const Snapshot& snapshot, std::size_t columns);

/// The main values in one line.
std::string render_line(const Snapshot& snapshot);

/// The whole snapshot as a JSON object in one line; run_id is a string of 16 hex digits.
std::string to_json(const Snapshot& snapshot);

}  // namespace sls::ctl
