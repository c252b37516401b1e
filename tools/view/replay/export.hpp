/// One self-contained page with recordings in it: `sls_view --export`, and the scene of the report.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace sls::view {

/// The bytes that `gzip` holds. @throws std::runtime_error if it is no gzip.
std::string unzip(std::string_view gzip);

/// The page with another text in its block `sls-mode`, which selects what the page shows.
/// @throws std::runtime_error if the page has no such block.
std::string set_mode(std::string_view page_html, std::string_view mode_json);

/// The page (from gzip) as text, set to show /recording/0 and further ones of its server.
/// @throws std::runtime_error if `page_html_gz` is not the page.
std::string make_replay_page(std::string_view page_html_gz, std::size_t recordings);

/// The page with `recordings` (load_recorded_run) as data blocks in it; it needs no server.
/// @throws std::runtime_error if `page_html` is not the page.
std::string make_export(std::string_view page_html, const std::vector<std::string>& recordings);

/// Default size limit of a page with recordings in it.
inline constexpr std::size_t kMostExportedBytes = 4'000'000;

/// Writes the page (from gzip) with the recordings of one or two folders into `file`. Leaves out
/// steps to keep to `most_bytes`. An earlier file stays until the new one is complete.
/// @throws config::ConfigError, record::DamagedError: as load_recorded_run; the former also if
///   `most_bytes` is too small.
/// @throws std::system_error naming the file.
void export_page(const std::filesystem::path& file, std::string_view page_html_gz,
                 const std::vector<std::filesystem::path>& folders, std::size_t most_bytes);

}  // namespace sls::view
