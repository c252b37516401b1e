#include "common/text/regular_file.hpp"

#include <cerrno>
#include <system_error>

namespace sls::text {

std::ifstream open_regular_file(const std::filesystem::path& file) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) throw NoRegularFile("none (" + error.message() + ")");
  if (fs::is_directory(status)) throw NoRegularFile("a directory");
  if (!fs::is_regular_file(status)) throw NoRegularFile("a pipe, socket or device");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw NoRegularFile(std::generic_category().message(errno));
  return stream;
}

}  // namespace sls::text
