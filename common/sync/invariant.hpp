#pragma once

#include <stdexcept>
#include <string>

namespace sls::sync {

/// A rule of docs/synchronisation.md that a core must keep whatever arrives. Flights check it, too:
/// it costs a comparison, and a run that breaks it ends with the name of the rule.
/// @throws std::logic_error if it does not hold.
inline void keep(bool holds, const char* rule) {
  if (!holds) throw std::logic_error(std::string("defect of this program: ") + rule);
}

}  // namespace sls::sync
