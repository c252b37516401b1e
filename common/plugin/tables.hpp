/// Common to plants, laws and autopilots in shared libraries: checks a library's table of
/// functions, creates its object, converts the vectors of C structs.
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

/// Buffer for the error message of a library.
class ErrorText {
 public:
  char* data() { return text_.data(); }
  std::size_t size() const { return text_.size() - 1; }
  /// The first line of the message; a default text if that is empty.
  std::string text() const;

 private:
  std::array<char, 513> text_{};  // the last byte stays 0: `size()` excludes it
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

/// The error message if `length` is not that of a unit vector or quaternion within 1e-6; else
/// empty.
std::string find_length_defect(double length, const std::string& kind, const std::string& name);

/// @throws config::ConfigError if a library was compiled against another header.
void check_version(const SharedLibrary& library, std::uint32_t expected, std::uint32_t got);
void check_size(const SharedLibrary& library, const std::string& type, std::size_t expected,
                std::size_t got);

/// The table that the function `call.function` of a library returns.
/// @throws config::ConfigError if there is none, or if it was compiled against another header.
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
/// @throws config::ConfigError `PLACE: LIBRARY: TEXT` if the library creates no object.
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
