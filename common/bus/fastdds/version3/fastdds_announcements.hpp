#pragma once

namespace sls::bus {

/// While it exists a participant may be deleted: nothing of announcements.cpp uses one.
class LeavingScope {
 public:
  LeavingScope();
  ~LeavingScope();
  LeavingScope(const LeavingScope&) = delete;
  LeavingScope& operator=(const LeavingScope&) = delete;
};

}  // namespace sls::bus
