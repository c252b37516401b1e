/// Replaces a function of Fast DDS 3 in all programs that have a Node. These programs then survive
/// the loss of a fragment.
///
/// A best-effort reader keeps a sample of which fragments are missing until a fragment of a later
/// one arrives, and then counts the samples that it lost since the one before. If a later sample
/// arrived whole in between, it asserts that this one is earlier, which ends the process: Debian
/// builds Fast DDS with assertions (README.md, trap 40). So here the function that tells the last
/// sample tells the reader of an earlier one that there is none, and it counts nothing.
///
/// Upstream: none reported; since 2.13.5, 3.6 has it, too. To be deleted when the reader drops an
/// unfinished sample as soon as it gets a later one.
#include <dlfcn.h>

#include <fastdds/rtps/common/Guid.hpp>
#include <fastdds/rtps/common/SequenceNumber.hpp>

namespace eprosima::fastdds::rtps {

/// A reader of samples; only the replaced function counts here.
class __attribute__((visibility("default"))) BaseReader {
 public:
  SequenceNumber_t update_last_notified(const GUID_t& writer, const SequenceNumber_t& sample);
};

SequenceNumber_t BaseReader::update_last_notified(const GUID_t& writer,
                                                  const SequenceNumber_t& sample) {
  constexpr const char* kName =
      "_ZN8eprosima7fastdds4rtps10BaseReader20update_last_notifiedERKNS1_6GUID_tERKNS1_"
      "16SequenceNumber_tE";
  static const auto original =
      reinterpret_cast<SequenceNumber_t (*)(BaseReader*, const GUID_t&, const SequenceNumber_t&)>(
          dlsym(RTLD_NEXT, kName));
  const SequenceNumber_t last = original(this, writer, sample);
  return last < sample ? last : SequenceNumber_t{0, 0};
}

}  // namespace eprosima::fastdds::rtps
