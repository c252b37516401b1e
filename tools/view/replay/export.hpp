/// One self-contained page with recordings in it: `sls_view --export`, and the scene of the report.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace sls::view {

/// The page with another text in its block `sls-mode`: how it learns what it is there for.
/// @throws std::runtime_error if the page has no such block.
std::string set_mode(std::string_view page_html, std::string_view mode_json);

/// The page (gzip) as text, told to show /recording/0 and further ones of the server it is from.
/// @throws std::runtime_error if it is not the page.
std::string make_replay_page(std::string_view page_html_gz, std::size_t recordings);

/// The page with `recordings` (load_recorded_run) as data blocks in it; asks no server for
/// anything.
/// @throws std::runtime_error if `page_html` is not the page.
std::string make_export(std::string_view page_html, const std::vector<std::string>& recordings);

/// Of a page with a recording in it, where nobody asked for another bound.
inline constexpr std::size_t kMostExportedBytes = 4'000'000;

/// Writes the page (gzip) with the recordings of one or two folders into `file`: at most
/// `most_bytes`, for which steps are left out. An earlier file stays until the new one is whole.
/// @throws config::ConfigError, record::DamagedError: as load_recorded_run; the former also where
///   `most_bytes` is too few.
/// @throws std::system_error naming the file.
void export_page(const std::filesystem::path& file, std::string_view page_html_gz,
                 const std::vector<std::filesystem::path>& folders, std::size_t most_bytes);

}  // namespace sls::view
