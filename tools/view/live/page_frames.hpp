/// Makes the binary messages of the page's protocol from batches of sls/record. Pure: no network,
/// no clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/scene/load_scene.hpp"
#include "tools/view/live/feed.hpp"

namespace sls::view {

class PageFrames {
 public:
  /// Most batches decoded for one frame, so that its cost does not depend on the speed of the
  /// flight. kMostBatches: for poses, because a fleet's step is spread over several batches;
  /// kMostRowBatches: for rows.
  static constexpr std::size_t kMostBatches = 16;
  static constexpr std::size_t kMostRowBatches = 4;
  /// Most rows in one message.
  static constexpr std::size_t kMostRows = 256;

  /// Discards the data of the run before.
  void start_run(const Parameters& parameters);

  /// Adds a sample of sls/record; it is not decoded yet.
  void add(const Sample& sample) { samples_.push_back(sample); }

  /// Decodes samples added since the last frame: the newest, until each vehicle is among them, then
  /// others up to kMostRowBatches in total. False if no state came.
  bool decode();

  /// The newest state of each vehicle that `decode` found.
  std::string make_poses() const;
  /// The decoded rows that are later than those of the message before, thinned; empty if there are
  /// none.
  std::string make_rows(std::uint32_t vehicle_id);

  /// The stage of the vehicle with the lowest id in its newest decoded entry; empty if that entry
  /// has no accepted answer.
  std::string find_stage() const;

  bool has_vehicle(std::uint32_t vehicle_id) const { return last_steps_.count(vehicle_id) > 0; }
  /// Requires a run.
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
  void append_cable(std::string& message, const PlantState& state) const;

  std::uint64_t run_id_ = 0;
  double period_s_ = 0;
  bool has_attitude_ = false;
  std::size_t signals_ = 0;
  std::vector<std::size_t> rotor_signals_;  // indices of the rotors' speeds
  std::optional<scene::LoadScene> scene_;
  std::map<std::uint32_t, std::uint64_t> last_steps_;  // last step of the rows made + 1, by vehicle
  std::vector<Sample> samples_;
  std::vector<Decoded> decoded_;  // `count_` are valid; the memory of the others is reused
  std::size_t count_ = 0;
  std::map<std::uint32_t, RecordEntry> newest_;  // of the last frame, by vehicle
  std::int64_t newest_written_ns_ = 0;
};

}  // namespace sls::view
