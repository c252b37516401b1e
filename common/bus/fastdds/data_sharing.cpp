#include "common/bus/fastdds/data_sharing.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <sstream>
#include <vector>

#include "common/bus/fastdds/stale_segments.hpp"

namespace sls::bus {
namespace {

constexpr const char* kSharedMemory = "/dev/shm";

#if defined(__x86_64__)
constexpr bool kKeepsOrderOfStores = true;
#else
constexpr bool kKeepsOrderOfStores = false;
#endif

}  // namespace

bool choose_data_sharing(dds::DataSharingQosPolicy& policy, bool is_on_this_machine) {
  if (policy.kind() != dds::AUTO) return false;
  struct stat folder {};
  if (!is_on_this_machine || !can_share_data || !kKeepsOrderOfStores ||
      ::stat(kSharedMemory, &folder) != 0) {
    policy.off();
    return false;
  }
  // Fast DDS would let all processes of a host share. Containers of a host may have a /dev/shm
  // each, on a device each, and the two versions put other contents under the same names.
  const auto id = minor(folder.st_dev) * 2 + (kFastDdsMajor == 2 ? 0 : 1);
  policy.automatic(std::vector<std::uint16_t>{static_cast<std::uint16_t>(id)});
  return true;
}

SharedDataLock::SharedDataLock(const rtps::GUID_t& endpoint) {
  std::ostringstream file;
  file << kSharedMemory << '/' << kDataSharingPrefix << endpoint.guidPrefix << '_'
       << endpoint.entityId;
  descriptor_ = ::open(file.str().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (descriptor_ < 0) return;
  ::flock(descriptor_, LOCK_SH);
  struct stat state {};
  if (::fstat(descriptor_, &state) == 0) ::fchmod(descriptor_, state.st_mode | kOwnMark);
}

SharedDataLock::~SharedDataLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace sls::bus
