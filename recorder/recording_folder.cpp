#include "recorder/recording_folder.hpp"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <string_view>
#include <system_error>

#include "common/config/config_error.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;
using config::ConfigError;

// The last one is a file of `./sls report`.
constexpr std::array<std::string_view, 13> kRecordingFiles = {
    "state.csv",     "measured.csv",       "command.csv",   "reference.csv", "status.csv",
    "flight.csv",    "sls.mcap",           "sls.mcap.part", "flight.txt",    "scenario.yaml",
    "manifest.json", "manifest.json.part", "report.html"};
// Figures that `./sls plot` puts into the subfolder kFigureFolder, as .png and .pdf.
constexpr std::array<std::string_view, 11> kFigures = {
    "fleet",    "positions",     "errors",     "path",   "angles", "forces",
    "attitude", "body_attitude", "body_rates", "rotors", "thrust"};
constexpr std::string_view kFigureFolder = "figures";

template <class Names>
bool is_among(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_recording_file(const fs::path& path) {
  return is_among(kRecordingFiles, path.filename().string());
}

bool is_figure(const fs::path& path) {
  return (path.extension() == ".png" || path.extension() == ".pdf") &&
         is_among(kFigures, path.stem().string());
}

/// True if `name` is `prefix`, followed only by `digits`.
bool is_numbered(std::string_view name, std::string_view prefix, std::string_view digits) {
  return name.size() > prefix.size() && name.substr(0, prefix.size()) == prefix &&
         name.find_first_not_of(digits, prefix.size()) == name.npos;
}

bool is_recording_subfolder(const fs::path& path) {
  const std::string name = path.filename().string();
  const bool is_run = is_numbered(name, "run-", "0123456789abcdef") && name.size() == 4 + 16;
  return is_run || (is_numbered(name, "segment-", "0123456789") && name[8] != '0');
}

fs::directory_iterator list(const std::string& place, const fs::path& folder) {
  std::error_code error;
  fs::directory_iterator entries(folder, error);
  if (error) throw ConfigError(place + ": expected a readable folder, got: " + error.message());
  return entries;
}

/// All files and subfolders of a recording in `folder`, each subfolder after its contents.
/// `is_ours` is true for the allowed files.
/// @throws ConfigError if something does not belong to a recording.
std::vector<fs::path> list_recording(const std::string& place, const fs::path& folder,
                                     bool (*is_ours)(const fs::path&) = is_recording_file) {
  std::vector<fs::path> paths;
  for (const auto& entry : list(place, folder)) {
    std::error_code error;
    const bool is_folder = fs::is_directory(entry.symlink_status(error));
    const bool is_of_figures = entry.path().filename() == kFigureFolder;
    if (is_folder && is_ours == is_recording_file &&
        (is_of_figures || is_recording_subfolder(entry.path()))) {
      const auto inside =
          list_recording(place, entry.path(), is_of_figures ? is_figure : is_recording_file);
      paths.insert(paths.end(), inside.begin(), inside.end());
    } else if (is_folder || !is_ours(entry.path())) {
      throw ConfigError(place + ": expected nothing but an earlier recording, got '" +
                        entry.path().filename().string() + "', which --force does not remove");
    }
    paths.push_back(entry.path());
  }
  return paths;
}

void remove_recording(const std::string& place, const fs::path& folder) {
  for (const fs::path& path : list_recording(place, folder)) {
    std::error_code error;
    fs::remove(path, error);
    if (error)
      throw ConfigError(place + ": expected to replace '" + path.filename().string() +
                        "', got: " + error.message());
  }
}

constexpr std::uintmax_t kLongestHeader = 1 << 20;  // as CsvReader

/// True if state.csv has no row: the recorder was killed after it had created the files.
bool is_without_rows(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_regular_file(folder / StateRow::kFile, error) ||
      fs::file_size(folder / StateRow::kFile, error) > kLongestHeader)
    return false;
  std::ifstream file(folder / StateRow::kFile);
  std::string header;
  return file && (!std::getline(file, header) || file.peek() == std::ifstream::traits_type::eof());
}

}  // namespace

void prepare_recording_folder(const fs::path& folder, bool force) {
  const std::string place = "--out " + folder.string();
  std::error_code error;
  fs::create_directories(folder, error);
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored))
    throw ConfigError(place + ": expected a folder, or a place for a new one, got: " +
                      (fs::exists(folder, ignored) ? "a file" : error.message()));
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    throw ConfigError(place + ": expected a folder that can be written, got: " +
                      std::generic_category().message(errno));
  if (force) return remove_recording(place, folder);
  for (const auto& entry : list(place, folder))
    throw ConfigError(place + ": expected an empty folder, got one with '" +
                      entry.path().filename().string() +
                      "' in it (--force replaces a recording, recorder --resume continues one)");
}

RecordingFolder::RecordingFolder(const fs::path& folder, bool force)
    : folder_(fs::absolute(folder).lexically_normal()) {
  std::error_code ignored;
  for (fs::path path = folder_; !fs::exists(path, ignored) && path.has_relative_path();
       path = path.parent_path())
    made_.push_back(path);
  prepare_recording_folder(folder, force);
}

RecordingFolder::~RecordingFolder() {
  std::error_code ignored;
  if (fs::exists(folder_ / "manifest.json", ignored)) return;
  for (const auto& entry : fs::directory_iterator(folder_, ignored))
    if (is_recording_file(entry.path())) fs::remove(entry.path(), ignored);
  for (const fs::path& folder : made_) fs::remove(folder, ignored);  // empty ones only
}

std::optional<OpenedRecording> find_unfinished_recording(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder / "manifest.json", error)) {
    prepare_recording_folder(folder, is_without_rows(folder));
    return std::nullopt;
  }
  OpenedRecording flight = open_recording(folder);
  if (flight.manifest().complete)
    throw ConfigError("--out " + folder.string() +
                      ": expected an unfinished recording to resume, got a complete one");
  return flight;
}

Segment make_next_segment(const OpenedRecording& earlier) {
  Segment segment;
  segment.number = static_cast<int>(earlier.segments.size()) + 1;
  segment.folder = earlier.folder / name_segment(segment.number);
  segment.first_step = find_next_step(earlier);
  segment.earlier = earlier;
  // A segment folder without a manifest is from a recorder that was killed before it wrote rows.
  prepare_recording_folder(segment.folder, true);
  return segment;
}

std::string name_run(std::uint64_t run_id) { return fmt::format("run-{:016x}", run_id); }

}  // namespace sls::record
