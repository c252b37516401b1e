#include "recorder/manifest.hpp"

#include <fcntl.h>
#include <gnu/libc-version.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <spdlog/fmt/fmt.h>
#include <cerrno>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <system_error>

#include "common/app/stop_signal.hpp"
#include "common/app/version.hpp"
#include "common/bus/names.hpp"
#include "common/bus/node.hpp"
#include "common/config/config_error.hpp"
#include "common/config/scenario_reader.hpp"
#include "common/sync/servers.hpp"
#include "common/text/sha256.hpp"

namespace sls::record {
namespace {

using Json = nlohmann::ordered_json;

/// The value of the first line "key : value" of /proc/cpuinfo; empty if there is none.
std::string read_cpu_info(const std::string& key) {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind(key, 0) != 0) continue;
    const auto colon = line.find(": ");
    return colon == std::string::npos ? "" : line.substr(colon + 2);
  }
  return "";
}

/// Extensions by which the C library chooses its code. Only plug-ins that call its elementary
/// functions depend on them.
Json list_math_features() {
  const std::string flags = " " + read_cpu_info("flags") + " ";
  Json features = Json::array();
  for (const char* feature : {"sse4_1", "avx", "fma", "avx2", "avx512f"})
    if (flags.find(std::string(" ") + feature + " ") != std::string::npos)
      features.push_back(feature);
  return features;
}

Json describe_machine() {
  utsname name{};
  uname(&name);
  return {{"system", app::system_name()},
          {"processor", read_cpu_info("model name")},
          {"architecture", name.machine},
          {"features", list_math_features()},
          {"libc", std::string("glibc ") + gnu_get_libc_version()},
          {"kernel", name.release}};
}

/// Limit of vehicles of one server (idl/sls.idl).
constexpr std::size_t kMaxVehicles = 256;
constexpr std::size_t kMaxBytes = 2'000'000;  // a thousand gaps take 120,000

/// Begins to write a file to the disk, without waiting for it.
void begin_sync(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;                                  // sync_to_disk reports it
  ::sync_file_range(descriptor, 0, 0, SYNC_FILE_RANGE_WRITE);  // only a hint
  ::close(descriptor);
}

/// The verification of a recording must open files of its folder only, so a manifest cannot name
/// others.
bool is_in_folder(const std::filesystem::path& name) {
  return name == name.filename() && name.has_filename() && name != "." && name != "..";
}

/// `json` in an error line.
std::string show(const Json& json) {
  return json.is_primitive() ? json.dump() : std::string("an ") + json.type_name();
}

/// Converts with a check: nlohmann itself would convert a number of any size, sign or fraction.
/// @throws config::ConfigError naming `key` if `value` is no whole number that `Whole` holds.
template <typename Whole>
Whole to_whole(const Json& value, const char* key) {
  constexpr Whole kMax = std::numeric_limits<Whole>::max();
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > kMax)
    throw config::ConfigError(
        fmt::format("{}: expected a whole number from 0 to {}, got {}", key, kMax, show(value)));
  return value.get<Whole>();
}

template <typename Whole>
Whole read_whole(const Json& json, const char* key) {
  return to_whole<Whole>(json.at(key), key);
}

std::vector<std::uint32_t> read_vehicle_ids(const Json& ids) {
  if (!ids.is_array() || ids.size() > kMaxVehicles)
    throw config::ConfigError(fmt::format("vehicle_ids: expected a list of at most {}, got {}",
                                          kMaxVehicles,
                                          ids.is_array() ? std::to_string(ids.size()) : show(ids)));
  std::vector<std::uint32_t> vehicle_ids;
  for (const Json& id : ids) vehicle_ids.push_back(to_whole<std::uint32_t>(id, "vehicle_ids"));
  return vehicle_ids;
}

ManifestFile to_manifest(const Json& json) {
  ManifestFile manifest;
  manifest.complete = json.at("complete");
  manifest.outcome = json.at("outcome");
  manifest.reason = json.at("reason");
  manifest.run_id = json.at("run_id");
  manifest.scenario_sha256 = json.at("scenario_sha256");
  manifest.mode = json.at("mode");
  manifest.period_s = json.at("period_s");
  manifest.vehicle_ids = read_vehicle_ids(json.at("vehicle_ids"));
  // Recordings of earlier versions have none of these four.
  if (json.contains("segment"))
    manifest.first_step = read_whole<std::uint64_t>(json.at("segment"), "first_step");
  manifest.certificate = json.value("certificate", "");
  manifest.contract_sha256 = json.value("contract_sha256", "");
  for (const Json& signal : json.value("signals", Json::array()))
    manifest.signals.push_back({signal.at("name"), signal.at("unit")});
  for (const auto& [name, file] : json.at("files").items()) {
    if (!is_in_folder(name))
      throw config::ConfigError("files: expected names of files beside it, got '" + name + "'");
    ManifestFile::File& entry = manifest.files[name];
    entry.sha256 = file.at("sha256");
    if (file.contains("rows")) entry.rows = read_whole<std::uint64_t>(file, "rows");
  }
  for (const Json& steps : json.at("missing"))
    manifest.missing.listed.push_back({read_whole<std::uint32_t>(steps, "vehicle_id"),
                                       steps.at("topic"), read_whole<std::uint64_t>(steps, "from"),
                                       read_whole<std::uint64_t>(steps, "to")});
  if (json.contains("further_missing")) {
    const Json& further = json.at("further_missing");
    manifest.missing.further_gaps = read_whole<std::uint64_t>(further, "gaps");
    manifest.missing.further_samples = read_whole<std::uint64_t>(further, "samples");
  }
  for (const Json& start : json.value("stage_starts", Json::array()))  // earlier versions: none
    manifest.stage_starts.push_back({read_whole<std::uint32_t>(start, "vehicle_id"),
                                     read_whole<std::uint32_t>(start, "stage"),
                                     read_whole<std::uint64_t>(start, "step")});
  return manifest;
}

}  // namespace

void sync_to_disk(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  // EINVAL: the file system does not support it for this file or folder.
  const bool is_done = descriptor >= 0 && (::fsync(descriptor) == 0 || errno == EINVAL);
  const int error = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!is_done)
    throw std::system_error(error, std::generic_category(), path.string() + ": cannot write");
}

void write_manifest(const std::filesystem::path& folder, const Manifest& manifest) {
  const Parameters& parameters = manifest.parameters;
  const app::Unhurried unhurried;  // the files are synchronised and read once more
  Json files = Json::object();
  for (const RecordedFile& file : manifest.files) begin_sync(file.path);
  for (const RecordedFile& file : manifest.files) {
    Json entry;
    if (file.has_rows) entry["rows"] = file.rows;
    entry["sha256"] = text::calc_file_sha256(file.path);
    files[file.path.filename().string()] = entry;
  }
  for (const RecordedFile& file : manifest.files) sync_to_disk(file.path);
  Json missing = Json::array();
  for (const MissingSteps& steps : manifest.missing.listed)
    missing.push_back({{"vehicle_id", steps.vehicle_id},
                       {"topic", steps.topic},
                       {"from", steps.from},
                       {"to", steps.to}});
  Json stage_starts = Json::array();
  for (const StageStart& start : manifest.stage_starts)
    stage_starts.push_back(
        {{"vehicle_id", start.vehicle_id}, {"stage", start.stage}, {"step", start.step}});

  Json json = {
      {"complete", manifest.complete},
      {"outcome", manifest.outcome},
      {"reason", manifest.reason},
      {"run_id", fmt::format("{:016x}", parameters.run_id())},
      {"scenario", manifest.scenario_name},
      {"scenario_sha256", parameters.scenario_sha256().to_string()},
      {"contract_sha256", parameters.contract_sha256().to_string()},
      {"vehicle_ids", sync::list_vehicle_ids(parameters)},
      {"period_s", static_cast<double>(parameters.period_ns()) / 1e9},
      {"step_s", static_cast<double>(parameters.step_ns()) / 1e9},
      {"mode", bus::to_string(parameters.mode())},
      {"timing", manifest.timing},
      {"certificate", manifest.certificate},
      {"segment", {{"number", manifest.segment}, {"first_step", manifest.first_step}}},
      {"last_step", manifest.last_step},
      {"versions",
       {{"recorder", app::version()},
        {"sim_server", parameters.version().to_string()},
        {"fast_dds", bus::middleware_version()},
        {"eigen", app::eigen_version()}}},
      {"machine", describe_machine()},
      {"files", files},
      {"missing", missing},
      {"stage_starts", stage_starts},
      {"unanswered_steps", manifest.unanswered_steps},
      {"refused_samples", manifest.refused_samples},
      {"dropped",
       {{"repeated", manifest.dropped.repeated}, {"out_of_range", manifest.dropped.out_of_range}}}};
  if (manifest.missing.further_gaps > 0)
    json["further_missing"] = {{"gaps", manifest.missing.further_gaps},
                               {"samples", manifest.missing.further_samples}};
  Json libraries;
  if (parameters.library_sha256().size() > 0)
    libraries["plant"] = parameters.library_sha256().to_string();
  if (!manifest.libraries.empty()) libraries["controllers"] = manifest.libraries;
  if (!libraries.empty()) json["libraries"] = libraries;
  for (const auto& [library, version] : manifest.format_versions)
    json["versions"][library] = version;
  for (const SignalDescription& signal : parameters.signals())
    json["signals"].push_back(
        {{"name", signal.name().to_string()}, {"unit", signal.unit().to_string()}});

  const auto target = folder / "manifest.json";
  const auto part = folder / "manifest.json.part";
  try {
    std::ofstream stream(part, std::ios::binary | std::ios::trunc);
    // Texts of samples can be cut within a UTF-8 character; the manifest must be written anyway.
    stream << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    stream.close();
    if (!stream)
      throw std::system_error(errno, std::generic_category(), target.string() + ": cannot write");
    sync_to_disk(part);
  } catch (const std::system_error&) {
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    throw;
  }
  std::filesystem::rename(part, target);
  sync_to_disk(folder);
}

ManifestFile read_manifest(const std::filesystem::path& folder) {
  const auto path = folder / "manifest.json";
  if (std::error_code error; !std::filesystem::exists(path, error))
    throw config::ConfigError(folder.string() +
                              ": expected a recording, got no manifest.json that can be read");
  const std::string text = config::read_config_file(path, "a manifest", kMaxBytes);
  try {
    return to_manifest(Json::parse(text));
  } catch (const Json::exception& error) {
    throw config::ConfigError(path.string() + ": expected a manifest, got: " + error.what());
  } catch (const config::ConfigError& error) {
    throw config::ConfigError(path.string() + ": " + error.what());
  }
}

}  // namespace sls::record
