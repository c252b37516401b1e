/// What plants, laws and autopilots in shared libraries have in common: the check of a library's table of
/// functions, and texts that it writes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "common/plugin/shared_library.hpp"

namespace sls::plugin {

/// Room for the text with which a library refuses.
class ErrorText {
 public:
  char* data() { return text_.data(); }
  std::size_t size() const { return text_.size() - 1; }
  /// Ends at the first line's end; never empty.
  std::string text() const;

 private:
  std::array<char, 513> text_{};  // the last byte stays 0, whatever the library does
};

/// Vectors as a C struct holds them.
inline void copy(const Eigen::Vector3d& from, double (&to)[3]) {
  for (int i = 0; i < 3; ++i) to[i] = from[i];
}
inline Eigen::Vector3d to_vector(const double (&from)[3]) { return {from[0], from[1], from[2]}; }

/// @throws config::ConfigError where a library was compiled against another header.
void check_version(const SharedLibrary& library, std::uint32_t expected, std::uint32_t got);
void check_size(const SharedLibrary& library, const std::string& type, std::size_t expected,
                std::size_t got);

}  // namespace sls::plugin
