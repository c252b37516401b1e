#include "common/bus/fastdds/data_sharing.hpp"

#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <cstdint>
#include <sstream>
#include <vector>

#include "common/bus/fastdds/host_id.hpp"
#include "common/bus/fastdds/stale_segments.hpp"

namespace sls::bus {
namespace {

constexpr const char* kSharedMemory = "/dev/shm";

#if defined(__x86_64__)
constexpr bool kKeepsOrderOfStores = true;
#else
constexpr bool kKeepsOrderOfStores = false;
#endif

std::filesystem::path find_file(const rtps::GUID_t& endpoint) {
  std::ostringstream file;
  file << kSharedMemory << '/' << kDataSharingPrefix << endpoint.guidPrefix << '_'
       << endpoint.entityId;
  return file.str();
}

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
  // each, on a device each, and another build puts other contents under the same names.
  const auto id = minor(folder.st_dev) * 40'503U + middleware_build();
  policy.automatic(std::vector<std::uint16_t>{static_cast<std::uint16_t>(id)});
  return true;
}

SharedDataLock::SharedDataLock(const rtps::GUID_t& endpoint)
    : file_(find_file(endpoint)), lock_(file_, LOCK_SH) {
  struct stat state {};
  if (::stat(file_.c_str(), &state) == 0) ::chmod(file_.c_str(), state.st_mode | kOwnMark);
}

}  // namespace sls::bus
