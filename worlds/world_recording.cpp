#include "worlds/world_recording.hpp"

#include <cerrno>
#include <set>
#include <system_error>
#include <utility>

#include "recorder/manifest.hpp"
#include "recorder/verification.hpp"

namespace sls::worlds {
namespace {

void add_row(std::map<std::uint32_t, StoredRecording::Rows>& rows, const record::StepRows& row) {
  StoredRecording::Rows& of_vehicle = rows[row.vehicle_id];
  of_vehicle.steps.push_back(row.step);
  of_vehicle.hashes.push_back(hash_row(row));
}

StoredRecording read_recording(const std::filesystem::path& folder) {
  const record::OpenedRecording opened = record::open_recording(folder);
  const record::ManifestFile& manifest = opened.manifest();
  StoredRecording stored;
  stored.run_id = std::stoull(manifest.run_id, nullptr, 16);
  stored.is_closed = manifest.outcome != "recording";
  stored.claims.complete = manifest.complete;
  stored.claims.outcome = manifest.outcome;
  stored.claims.missing = manifest.missing;
  stored.certificate = manifest.certificate;
  if (stored.is_closed) stored.damages = record::inspect(opened).problems;
  try {
    record::StepReader reader(opened);
    while (const auto row = reader.next_as_written())
      if (row->has_state) add_row(stored.rows, *row);
  } catch (const record::DamagedError& error) {
    if (!stored.is_closed) stored.damages.emplace_back(error.what());
  }
  return stored;
}

}  // namespace

MemoryRecording::MemoryRecording(StoredRecording& stored, const Parameters& parameters,
                                 double flush_s, sync::Time now, const bool& is_disk_full, Say say)
    : stored_(stored),
      is_disk_full_(is_disk_full),
      say_(std::move(say)),
      core_(parameters, 0, flush_s, now, *this) {}

bool MemoryRecording::add(const record::StepRows& rows) {
  certificate_.add(rows);
  if (!rows.has_state) return false;
  add_row(unwritten_, rows);
  unwritten_[rows.vehicle_id].answers.push_back(
      {hash_answer(rows), rows.is_unanswered(), rows.has_command, rows.has_reference});
  return false;
}

void MemoryRecording::flush() {
  if (is_disk_full_) throw std::system_error(ENOSPC, std::generic_category(), "state.csv");
  for (auto& [vehicle, rows] : unwritten_) {
    StoredRecording::Rows& kept = stored_.rows[vehicle];
    kept.steps.insert(kept.steps.end(), rows.steps.begin(), rows.steps.end());
    kept.hashes.insert(kept.hashes.end(), rows.hashes.begin(), rows.hashes.end());
    kept.answers.insert(kept.answers.end(), rows.answers.begin(), rows.answers.end());
    rows = {};
  }
}

record::RecorderCore::Recorded MemoryRecording::close(const record::RunWatch::End& end,
                                                      std::uint64_t refused) {
  const record::Claims claims = core_.on_end({end.interruption, end.outcome}, refused);
  core_.flush();
  stored_.claims = claims;  // the last manifest comes after the rows
  stored_.certificate = certificate_.finish();
  stored_.is_closed = true;
  record::RecorderCore::Recorded recorded;
  recorded.is_complete = stored_.claims.complete;
  if (!recorded.is_complete) recorded.gaps = core_.describe_gaps();
  recorded.is_reset = core_.has_phase(RunPhase::PHASE_RESET);
  recorded.last_step = core_.last_complete_step();
  return recorded;
}

void lose_unsynced(const std::filesystem::path& folder, Random& random) {
  namespace fs = std::filesystem;
  // In order of names: the order of a folder is that of its file system.
  std::set<fs::path> files;
  if (!fs::exists(folder)) return;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.insert(entry.path());
  for (const fs::path& file : files) {
    const fs::path manifest = file.parent_path() / "manifest.json";
    const bool is_synced =
        file == manifest ||
        (files.count(manifest) > 0 &&
         record::read_manifest(file.parent_path()).files.count(file.filename()) > 0);
    if (!is_synced) fs::resize_file(file, random.index(fs::file_size(file) + 1));
  }
}

std::vector<StoredRecording> read_recordings(const std::filesystem::path& folder) {
  std::vector<StoredRecording> found;
  if (std::filesystem::exists(folder / "manifest.json")) found.push_back(read_recording(folder));
  if (!std::filesystem::exists(folder)) return found;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_directory() && entry.path().filename().string().rfind("run-", 0) == 0)
      found.push_back(read_recording(entry.path()));
  return found;
}

}  // namespace sls::worlds
