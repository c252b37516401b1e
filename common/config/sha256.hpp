#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace sls::config {

/// SHA-256 of `bytes` as 64 lower-case hex digits.
std::string calc_sha256(std::string_view bytes);

/// SHA-256 of a file's content, read in blocks.
/// @throws std::system_error naming the file where it cannot be read.
std::string calc_file_sha256(const std::filesystem::path& file);

}  // namespace sls::config
