#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string_view>

namespace sls::record {

/// write(2), or a disk that fills up or writes less than it was asked to (worlds/, tests).
using WriteCall = std::function<ssize_t(int descriptor, const void* bytes, std::size_t size)>;
WriteCall system_write();

/// A file that only grows, by whole pieces.
class GrowingFile {
 public:
  /// Creates `path`, which must not exist.
  /// @throws std::system_error with the name of the file if it cannot be created.
  explicit GrowingFile(const std::filesystem::path& path, WriteCall write = system_write());
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;

  /// Appends `bytes` and goes on after a short write. If a write fails, the file keeps only as many
  /// bytes of them as `choose_kept(written)` says: part of a row or record would look like data.
  /// @throws std::system_error with the name of the file if a write fails.
  template <class ChooseKept>
  void append(std::string_view bytes, const ChooseKept& choose_kept) {
    int error = 0;
    const std::size_t written = try_append(bytes, error);
    if (error != 0) fail(error, written - choose_kept(written));
  }

  const std::filesystem::path& path() const { return path_; }

 private:
  /// Returns the number of bytes written; if some are missing, `error` says why.
  std::size_t try_append(std::string_view bytes, int& error);
  [[noreturn]] void fail(int error, std::size_t surplus);

  const std::filesystem::path path_;
  const WriteCall write_;
  int descriptor_ = -1;
};

}  // namespace sls::record
