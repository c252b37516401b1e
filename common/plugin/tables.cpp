#include "common/plugin/tables.hpp"

#include <cmath>

namespace sls::plugin {

std::string ErrorText::text() const {
  const std::string text(text_.data());
  const std::string line = text.substr(0, text.find('\n'));
  return line.empty() ? "failed without saying why" : line;
}

std::string find_length_defect(double length, const std::string& kind, const std::string& name) {
  constexpr double kTolerance = 1e-6;
  if (std::abs(length - 1.0) <= kTolerance) return "";
  return "expected a unit " + kind + " as " + name + ", got one of length " +
         std::to_string(length);
}

void check_version(const SharedLibrary& library, std::uint32_t expected, std::uint32_t got) {
  if (got != expected)
    library.fail("expected version " + std::to_string(expected) + " of the interface, got " +
                 std::to_string(got));
}

void check_size(const SharedLibrary& library, const std::string& type, std::size_t expected,
                std::size_t got) {
  if (got != expected)
    library.fail("expected sizeof(" + type + ") " + std::to_string(expected) + ", got " +
                 std::to_string(got) + "; compile it against the header of this version");
}

}  // namespace sls::plugin
