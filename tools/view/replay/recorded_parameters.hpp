/// The parameters of a run from its recording, as the run itself published them.
#pragma once

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "recorder/recording_reader.hpp"

namespace sls::view {

struct RecordedParameters {
  Parameters message;  ///< with what the page needs: no hashes, no limits
  config::Scenario scenario;
};

/// From scenario.yaml, manifest.json and the header of state.csv; those of contract 1, whose
/// manifest has no signals, have no attitude either.
/// @throws config::ConfigError naming the file; record::DamagedError for the header of state.csv.
RecordedParameters load_parameters(const record::RecordedFlight& flight);

}  // namespace sls::view
