#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace sls::record {

/// The topic of missing batches of late answers, which have no file of their own.
inline constexpr const char* kBatchTopic = "sls/record";

/// Consecutive steps of one topic that are not in the recording. For sls/status, from and to are
/// values of sample_index, for kBatchTopic of batch_index.
struct MissingSteps {
  std::uint32_t vehicle_id = 0;
  std::string topic;
  std::uint64_t from = 0;
  std::uint64_t to = 0;  ///< inclusive
};

/// The gaps of a recording. Only the first ones are listed: a bad link can cause new ones for days.
struct MissingSamples {
  static constexpr std::size_t kMaxListed = 1000;

  std::vector<MissingSteps> listed;
  std::uint64_t further_gaps = 0;     ///< not listed
  std::uint64_t further_samples = 0;  ///< missing in these

  bool empty() const { return listed.empty(); }
};

/// "3 samples missing, first sls/reference step 123 of vehicle 0"; `missing` is not empty.
std::string describe(const MissingSamples& missing);

/// Collects the gaps. Those of a topic of a vehicle that follow each other are one.
class GapList {
 public:
  void add(std::uint32_t vehicle_id, const char* topic, std::uint64_t from, std::uint64_t to);
  const MissingSamples& missing() const { return missing_; }

 private:
  struct LastGap {
    std::uint64_t to = 0;
    std::size_t index = 0;  // in missing_.listed; its greatest size if it is not listed
  };
  MissingSamples missing_;
  std::map<std::pair<std::uint32_t, std::string>, LastGap> last_gaps_;  // of vehicle and topic
};

}  // namespace sls::record
