#include "recorder/manifest.hpp"

#include <gnu/libc-version.h>
#include <sys/utsname.h>

#include <spdlog/fmt/fmt.h>
#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "common/app/options.hpp"
#include "common/bus/names.hpp"
#include "common/bus/node.hpp"
#include "common/config/sha256.hpp"

namespace sls::record {
namespace {

using Json = nlohmann::ordered_json;

/// The value of the first line "key : value" of /proc/cpuinfo; empty where there is none.
std::string read_cpu_info(const std::string& key) {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind(key, 0) != 0) continue;
    const auto colon = line.find(": ");
    return colon == std::string::npos ? "" : line.substr(colon + 2);
  }
  return "";
}

/// Vector extensions that libc's sin and cos choose their code by: results are the same bytes on
/// machines where these are the same.
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
  return {{"processor", read_cpu_info("model name")},
          {"architecture", name.machine},
          {"features", list_math_features()},
          {"libc", std::string("glibc ") + gnu_get_libc_version()},
          {"kernel", name.release}};
}

}  // namespace

void write_manifest(const std::filesystem::path& folder, const Manifest& manifest) {
  const Parameters& parameters = manifest.parameters;
  Json files = Json::object();
  for (const RecordedFile& file : manifest.files) {
    Json entry;
    if (file.has_rows) entry["rows"] = file.rows;
    entry["sha256"] = config::calc_file_sha256(file.path);
    files[file.path.filename().string()] = entry;
  }
  Json missing = Json::array();
  for (const MissingSteps& steps : manifest.missing)
    missing.push_back({{"vehicle_id", steps.vehicle_id},
                       {"topic", steps.topic},
                       {"from", steps.from},
                       {"to", steps.to}});

  const Json json = {{"complete", manifest.complete},
                     {"outcome", manifest.outcome},
                     {"reason", manifest.reason},
                     {"run_id", fmt::format("{:016x}", parameters.run_id())},
                     {"scenario", manifest.scenario_name},
                     {"scenario_sha256", parameters.scenario_sha256().to_string()},
                     {"vehicle_ids", parameters.vehicle_ids()},
                     {"period_s", static_cast<double>(parameters.period_ns()) / 1e9},
                     {"step_s", static_cast<double>(parameters.step_ns()) / 1e9},
                     {"mode", bus::to_string(parameters.mode())},
                     {"last_step", manifest.last_step},
                     {"versions",
                      {{"recorder", app::version()},
                       {"sim_server", parameters.version().to_string()},
                       {"fast_dds", bus::middleware_version()}}},
                     {"machine", describe_machine()},
                     {"files", files},
                     {"missing", missing},
                     {"refused_samples", manifest.refused_samples}};

  const auto target = folder / "manifest.json";
  const auto part = folder / "manifest.json.part";
  std::ofstream stream(part, std::ios::binary | std::ios::trunc);
  // Texts that came over the wire may be cut within a letter: no reason to have no manifest.
  stream << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
  stream.close();
  if (!stream) {
    const int error = errno;
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    throw std::system_error(error, std::generic_category(), target.string() + ": cannot write");
  }
  std::filesystem::rename(part, target);
}

}  // namespace sls::record
