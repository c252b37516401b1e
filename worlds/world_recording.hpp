#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "recorder/certificate.hpp"
#include "recorder/core/recorder_core.hpp"
#include "recorder/core/recording_core.hpp"
#include "recorder/recording.hpp"
#include "worlds/properties.hpp"
#include "worlds/random.hpp"

namespace sls::worlds {

/// The recording of a run that a recorder of a world writes.
class WorldRecording {
 public:
  virtual ~WorldRecording() = default;
  virtual void add(const RecordBatch& batch, sync::Time now) = 0;
  virtual void add(const SimStatus& status) = 0;
  virtual void on_time(sync::Time now) = 0;
  virtual bool is_whole() const = 0;
  virtual std::int64_t last_complete_step() const = 0;
  virtual record::RecorderCore::Recorded close(const record::RunWatch::End& end,
                                               std::uint64_t refused) = 0;
};

/// As the program writes it, with all its files. Destroyed without `close`, it loses what a killed
/// program loses.
class FileRecording final : public WorldRecording {
 public:
  FileRecording(const record::Segment& segment, const Parameters& parameters, sync::Time now)
      : recording_(segment, parameters, now) {}

  void add(const RecordBatch& batch, sync::Time now) override { recording_.add(batch, now); }
  void add(const SimStatus& status) override { recording_.add(status); }
  void on_time(sync::Time now) override { recording_.flush_if_due(now); }
  bool is_whole() const override { return recording_.has_all(); }
  std::int64_t last_complete_step() const override { return recording_.last_complete_step(); }
  record::RecorderCore::Recorded close(const record::RunWatch::End& end,
                                       std::uint64_t refused) override {
    return recording_.close(end, refused);
  }

 private:
  record::Recording recording_;
};

/// Rows alone: as the program decides, without its files, because files are slow.
class MemoryRecording final : public WorldRecording, private record::RecordingOutputs {
 public:
  using Say = std::function<void(const sync::Line&)>;
  /// Rows and claims that reach the disk go into `stored`. Every member @throws std::system_error
  /// while `is_disk_full`.
  MemoryRecording(StoredRecording& stored, const Parameters& parameters, double flush_s,
                  sync::Time now, const bool& is_disk_full, Say say);

  void add(const RecordBatch& batch, sync::Time now) override { core_.on_batch(batch, now); }
  void add(const SimStatus& status) override { core_.on_status(status); }
  void on_time(sync::Time now) override { core_.on_time(now); }
  bool is_whole() const override { return core_.phase() == record::RecordingCore::Phase::kWhole; }
  std::int64_t last_complete_step() const override { return core_.last_complete_step(); }
  record::RecorderCore::Recorded close(const record::RunWatch::End& end,
                                       std::uint64_t refused) override;

 private:
  bool add(const record::StepRows& rows) override;
  void add(const SimStatus&, bool) override {}
  void add_event(const std::string&) override {}
  bool has_new_stage() const override { return false; }
  void write_manifest(const record::Claims& claims) override { stored_.claims = claims; }
  void flush() override;
  void log(const sync::Line& line) override { say_(line); }

  StoredRecording& stored_;
  const bool& is_disk_full_;
  const Say say_;
  record::Certificate certificate_;
  std::map<std::uint32_t, StoredRecording::Rows> unwritten_;  // rows that are not on the disk
  record::RecordingCore core_;
};

/// Leaves in `folder` as much as a power cut: manifests, the files that they list, and the
/// beginning of all others, which were not synchronised.
void lose_unsynced(const std::filesystem::path& folder, Random& random);

/// Reads all recordings in `folder`, those of further runs, too.
std::vector<StoredRecording> read_recordings(const std::filesystem::path& folder);

}  // namespace sls::worlds
