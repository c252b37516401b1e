#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace sls::text {

/// What was found instead of a regular file that can be read, such as "a directory".
class NoRegularFile : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Opens a file that others may have made. A pipe, a socket or a device is not opened: its reader
/// could wait, or read, for ever.
/// @throws NoRegularFile
std::ifstream open_regular_file(const std::filesystem::path& file);

}  // namespace sls::text
