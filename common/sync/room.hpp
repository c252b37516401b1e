#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>

#include "common/bus/peer.hpp"

namespace sls::sync {

/// True if `known` has room for `sender`. If `known` is full, it drops a participant that is not
/// `present`.
template <class Known>
bool make_room(std::map<bus::PeerId, Known>& known, std::size_t most, const bus::PeerId& sender,
               const std::set<bus::PeerId>& present) {
  if (known.count(sender) > 0 || known.size() < most) return true;
  const auto gone = std::find_if(known.begin(), known.end(),
                                 [&](const auto& item) { return present.count(item.first) == 0; });
  if (gone == known.end()) return false;
  known.erase(gone);
  return true;
}

}  // namespace sls::sync
