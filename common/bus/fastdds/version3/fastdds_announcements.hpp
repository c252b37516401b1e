#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>

#include "fastdds_api.hpp"

namespace sls::bus {

/// While it exists `participant` may be deleted: announcements.cpp does not use it.
class LeavingScope {
 public:
  explicit LeavingScope(const dds::DomainParticipant& participant);
  ~LeavingScope();
  LeavingScope(const LeavingScope&) = delete;
  LeavingScope& operator=(const LeavingScope&) = delete;

 private:
  const int participant_;
};

}  // namespace sls::bus
