#pragma once

#include <algorithm>
#include <cstddef>
#include <map>

#include "common/bus/peer.hpp"

namespace sls::sync {

/// True if `known` has room for `sender`. If `known` is full, it drops a participant that is not
/// present.
template <class Known, class IsPresent>
bool make_room(std::map<bus::PeerId, Known>& known, std::size_t most, const bus::PeerId& sender,
               const IsPresent& is_present) {
  if (known.count(sender) > 0 || known.size() < most) return true;
  const auto gone = std::find_if(known.begin(), known.end(),
                                 [&](const auto& item) { return !is_present(item.first); });
  if (gone == known.end()) return false;
  known.erase(gone);
  return true;
}

}  // namespace sls::sync
