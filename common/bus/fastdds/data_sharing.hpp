/// Data sharing: a reader reads a sample where the writer has put it, in memory that both map. No
/// message is built, queued and parsed. sim_server and control_client share the samples of the loop
/// if they use shared memory (config/qos/default.xml).
#pragma once

#include <filesystem>

#include "common/bus/fastdds/file_lock.hpp"
#include "common/bus/fastdds/shared_locks.hpp"
#include "fastdds_api.hpp"

namespace sls::bus {

/// Lets an endpoint whose `policy` is automatic share data, with those processes alone that use the
/// same /dev/shm and the same version of Fast DDS. Else, or where sharing would not work, it
/// becomes off: in programs without `can_share_data`, and on processors that may show other
/// processes a sample's stores in another order (Fast DDS orders them only by a notification, for
/// which a busy reader does not wait). Returns whether it shares data.
bool choose_data_sharing(dds::DataSharingQosPolicy& policy, bool is_on_this_machine);

/// Locks the shared memory of an endpoint that shares data while this object exists, and marks it,
/// so that `remove_stale_segments` takes it for that of a killed process only afterwards.
class SharedDataLock {
 public:
  explicit SharedDataLock(const rtps::GUID_t& endpoint);

 private:
  const std::filesystem::path file_;
  const FileLock lock_;
};

}  // namespace sls::bus
