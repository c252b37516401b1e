#include "recorder/sinks/growing_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace sls::record {
namespace {

[[noreturn]] void throw_error(int error, const std::filesystem::path& file, const char* what) {
  throw std::system_error(error, std::generic_category(), file.string() + ": " + what);
}

}  // namespace

WriteCall system_write() { return ::write; }

GrowingFile::GrowingFile(const std::filesystem::path& path, WriteCall write)
    : path_(path), write_(std::move(write)) {
  descriptor_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644);
  if (descriptor_ < 0) throw_error(errno, path_, "cannot create");
}

GrowingFile::~GrowingFile() { ::close(descriptor_); }

std::size_t GrowingFile::try_append(std::string_view bytes, int& error) {
  std::size_t written = 0;
  while (written < bytes.size() && error == 0) {
    const ssize_t count = write_(descriptor_, bytes.data() + written, bytes.size() - written);
    if (count >= 0)
      written += static_cast<std::size_t>(count);
    else if (errno != EINTR)
      error = errno;
  }
  return written;
}

void GrowingFile::fail(int error, std::size_t surplus) {
  const off_t end = ::lseek(descriptor_, 0, SEEK_END);
  if (end >= static_cast<off_t>(surplus) &&
      ::ftruncate(descriptor_, end - static_cast<off_t>(surplus)) != 0) {
    // The earlier error is reported.
  }
  throw_error(error, path_, "cannot write");
}

}  // namespace sls::record
