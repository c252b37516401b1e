/// A recording as the page replays it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace sls::view {

/// Largest answer of sls_view for a recording: has more steps than a slider or a plot has pixels.
inline constexpr std::size_t kMostServedBytes = 48 << 20;

/// The bytes of GET /recording/0 and of the report's scene; README.md describes their format. Steps
/// are left out, every k-th kept and the first and last one too, so that at most `most_bytes`
/// result. Recordings of contract 1 open, too.
/// @throws config::ConfigError: no recording, or its first and last steps alone are longer than
///   `most_bytes`.
/// @throws record::DamagedError naming file and line.
std::string load_recorded_run(const std::filesystem::path& folder, std::size_t most_bytes);

}  // namespace sls::view
