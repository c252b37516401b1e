/// Restores the parameters of a run from its recording.
#pragma once

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "recorder/recording_reader.hpp"

namespace sls::view {

struct RecordedParameters {
  Parameters message;  ///< only the fields that the page needs
  config::Scenario scenario;
};

/// Reads scenario.yaml, manifest.json and the header of state.csv. Recordings of contract 1 have
/// neither signals in the manifest nor an attitude.
/// @throws config::ConfigError naming the file; record::DamagedError for the header of state.csv.
RecordedParameters load_parameters(const record::OpenedRecording& flight);

}  // namespace sls::view
