/// The binary messages of the page's protocol from batches of sls/record. Pure: no network, no
/// clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"
#include "tools/view/live/feed.hpp"

namespace sls::view {

class PageFrames {
 public:
  /// Batches decoded for one frame, at most, so that it costs the same however fast the flight is:
  /// for poses, which a fleet's step is spread over, and for rows.
  static constexpr std::size_t kMostBatches = 16;
  static constexpr std::size_t kMostRowBatches = 4;
  /// Rows in one message, at most.
  static constexpr std::size_t kMostRows = 256;

  /// Forgets what there was.
  void start_run(const Parameters& parameters);

  /// A sample of sls/record; kept as it came.
  void add(const Sample& sample) { samples_.push_back(sample); }
  /// Forgets the samples added since the last frame.
  void clear_samples() { samples_.clear(); }

  /// Decodes of the samples added since the last frame the newest, until each vehicle is in them,
  /// and of the others as many as a frame may cost. False if no state came.
  bool decode();

  /// Of what was decoded last: the newest state of each vehicle.
  std::string make_poses() const;
  /// Of what was decoded last: rows later than those of the message before, thinned; empty if
  /// there are none.
  std::string make_rows(std::uint32_t vehicle_id);

  /// Of what was decoded last: the stage that the vehicle of the lowest id flies; empty if no
  /// answer says it.
  std::string find_stage() const;

  bool has_vehicle(std::uint32_t vehicle_id) const { return last_steps_.count(vehicle_id) > 0; }
  /// Expects a run.
  std::uint32_t lowest_vehicle() const { return last_steps_.begin()->first; }
  std::uint64_t run_id() const { return run_id_; }

 private:
  struct Decoded {
    RecordBatch batch;
    std::int64_t written_ns = 0;
  };

  bool decode_one(const Sample& sample);
  void note_newest(const RecordBatch& batch);
  double calc_time(std::uint64_t step) const;
  std::vector<const RecordEntry*> find_rows(std::uint32_t vehicle_id, std::uint64_t from) const;
  void append_values(std::string& message, const RecordEntry& entry) const;
  float calc_rotor_rate(const RecordEntry& entry) const;

  std::uint64_t run_id_ = 0;
  double period_s_ = 0;
  bool has_attitude_ = false;
  std::size_t signals_ = 0;
  std::vector<std::size_t> rotor_signals_;             // indices of the rotors' speeds
  std::map<std::uint32_t, std::uint64_t> last_steps_;  // + 1, of the rows made; by vehicle
  std::vector<Sample> samples_;
  std::vector<Decoded> decoded_;  // the first `count_` of them; the others' memory is used again
  std::size_t count_ = 0;
  std::map<std::uint32_t, RecordEntry> newest_;  // of the last frame, by vehicle
  std::int64_t newest_written_ns_ = 0;
};

}  // namespace sls::view
