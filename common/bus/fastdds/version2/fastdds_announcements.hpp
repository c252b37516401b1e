#pragma once

namespace sls::bus {

/// Nothing to do: see version3/announcements.cpp.
struct LeavingScope {
  LeavingScope() {}
};

}  // namespace sls::bus
