#pragma once

#include <filesystem>

namespace sls::record {

/// Makes `folder` ready for a recording: creates it, or takes an empty one. One that is not empty
/// is refused; with `force`, the files of an earlier recording in it are removed, and anything else
/// in it is still refused.
/// @throws config::ConfigError naming the folder and the cause.
void prepare_recording_folder(const std::filesystem::path& folder, bool force);

}  // namespace sls::record
