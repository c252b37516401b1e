/// Common to plants, laws and autopilots in shared libraries: the check of a library's
/// table of functions, the making of its object, vectors as C has them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "common/config/config_error.hpp"
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

/// The same of a quaternion: w, x, y, z.
inline void copy(const Eigen::Quaterniond& from, double (&to)[4]) {
  to[0] = from.w();
  to[1] = from.x();
  to[2] = from.y();
  to[3] = from.z();
}
inline Eigen::Quaterniond to_quaternion(const double (&from)[4]) {
  return {from[0], from[1], from[2], from[3]};
}

/// Why `length` is not that of a unit vector or quaternion; empty if it is. A library may be off
/// by 1e-6.
std::string find_length_defect(double length, const std::string& kind, const std::string& name);

/// @throws config::ConfigError if a library was compiled against another header.
void check_version(const SharedLibrary& library, std::uint32_t expected, std::uint32_t got);
void check_size(const SharedLibrary& library, const std::string& type, std::size_t expected,
                std::size_t got);

/// The table that the function `call.function` of a library returns.
/// @throws config::ConfigError if there is none, or where it is one of another header.
template <class Functions>
const Functions& load_table(const SharedLibrary& library, const Call& call, std::uint32_t version) {
  const std::string function = call.function;
  const auto entry = reinterpret_cast<const Functions* (*)()>(library.find(call.function));
  const Functions* functions = nullptr;
  library.call(call, [&] { functions = entry(); });
  if (!functions) library.fail(function + "() returned no table of functions");
  check_version(library, version, functions->version);
  check_size(library, function + "_functions", sizeof *functions, functions->size);
  return *functions;
}

/// The result of `create(error, error_size)` of a library. `place` is FILE:LINE: KEY.
/// @throws config::ConfigError `PLACE: LIBRARY: TEXT` where the library refuses.
template <class Create>
void* create_object(const SharedLibrary& library, const Call& call, const std::string& place,
                    const Create& create) {
  ErrorText error;
  void* made = nullptr;
  library.call(call, [&] { made = create(error.data(), error.size()); });
  if (!made) throw config::ConfigError(place + ": " + library.name() + ": " + error.text());
  return made;
}

}  // namespace sls::plugin
