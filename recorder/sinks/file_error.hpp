#pragma once

#include <cerrno>
#include <filesystem>
#include <system_error>

namespace sls::record {

/// @throws std::system_error with `errno`: `FILE: WHAT`, such as "cannot write".
[[noreturn]] inline void throw_errno(const std::filesystem::path& file, const char* what) {
  throw std::system_error(errno, std::generic_category(), file.string() + ": " + what);
}

}  // namespace sls::record
