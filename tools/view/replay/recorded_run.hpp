/// A recording in the format that the page replays.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

namespace sls::view {

/// Largest answer of sls_view for a recording. It holds more steps than a slider or a plot has
/// pixels.
inline constexpr std::size_t kMostServedBytes = 48 << 20;

/// The bytes of GET /recording/0 and of the report's scene; README.md describes their format. To
/// keep to `most_bytes`, only every k-th step and the first and last one are kept. Recordings of
/// contract 1 can be opened, too. `name`: of the recording on the page; empty: that of the folder.
/// @throws config::ConfigError: no recording, or its first and last steps alone are longer than
///   `most_bytes`.
/// @throws record::DamagedError naming file and line; std::runtime_error once `must_stop`.
std::string load_recorded_run(
    const std::filesystem::path& folder, std::size_t most_bytes, const std::string& name = {},
    const std::function<bool()>& must_stop = [] { return false; });

}  // namespace sls::view
