#include "recorder/sinks/mcap/mcap_sink.hpp"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "common/bus/contract_text.hpp"
#include "common/sync/servers.hpp"

namespace sls::record {
namespace {

using Json = nlohmann::ordered_json;

/// A vehicle is mirrored at its first step in each period of this length.
constexpr std::int64_t kMirrorPeriodNs = 10'000'000;

/// Not in the file: the log time of every message is simulation time, so no clock is needed.
constexpr std::string_view kClockTopic = "/clock";
constexpr std::uint16_t kLeftOut = 0;  // no channel

/// The fields of manifest.json that are the same for equal flights, on every machine and at any
/// time.
std::string describe(const Parameters& parameters) {
  const Compression compression = describe_compression();
  Json json = {{"scenario_sha256", parameters.scenario_sha256().to_string()},
               {"contract_sha256", parameters.contract_sha256().to_string()},
               {"vehicle_ids", sync::list_vehicle_ids(parameters)},
               {"period_s", static_cast<double>(parameters.period_ns()) / 1e9},
               {"signals", Json::array()},
               {"compression",
                {{"library", compression.library},
                 {"version", compression.version},
                 {"level", compression.level}}}};
  for (const SignalDescription& signal : parameters.signals())
    json["signals"].push_back(
        {{"name", signal.name().to_string()}, {"unit", signal.unit().to_string()}});
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace

McapSink::McapSink(const std::filesystem::path& file, const Parameters& parameters, WriteCall write)
    : period_ns_(parameters.period_ns()),
      file_(file, std::move(write)),
      mirrors_(sync::list_vehicle_ids(parameters), scene::read_load_scene(parameters)),
      emit_([this](std::size_t channel, std::int64_t time_ns, const auto& message) {
        write_mirror(channel, time_ns, message);
      }) {
  for (const std::uint32_t id : sync::list_vehicle_ids(parameters)) vehicles_[id];
  add_channels();
  add_attachments(parameters);
  mirrors_.emit_static(emit_);
}

void McapSink::add_channels() {
  const std::uint16_t entry = file_.add_schema("sls::RecordEntry", "omgidl", bus::kContractText);
  for (auto& [id, vehicle] : vehicles_)
    vehicle.channel = file_.add_channel(entry, fmt::format("/sls/vehicle_{}/record", id), "cdr");
  std::map<std::string, std::uint16_t> schemas;  // by type
  for (const ros::Channel& channel : mirrors_.channels()) {
    std::uint16_t& id = mirror_channels_.emplace_back(kLeftOut);
    if (channel.topic == kClockTopic) continue;
    std::uint16_t& schema = schemas[channel.type];
    if (schema == 0) schema = file_.add_schema(channel.type, "ros2msg", channel.schema);
    id = file_.add_channel(schema, channel.topic, "cdr");
  }
}

void McapSink::add_attachments(const Parameters& parameters) {
  file_.add_attachment("scenario.yaml", "application/yaml", parameters.scenario_text().to_string());
  file_.add_attachment("manifest.json", "application/json", describe(parameters));
}

void McapSink::add(const StepRows& rows) {
  const auto vehicle = vehicles_.find(rows.vehicle_id);
  if (vehicle == vehicles_.end()) return;  // not a vehicle of the run
  const auto time_ns = static_cast<std::int64_t>(rows.step) * period_ns_;
  file_.add_message(vehicle->second.channel, static_cast<std::uint32_t>(rows.step),
                    static_cast<std::uint64_t>(time_ns), message_.serialize(rows));
  const std::int64_t slot = time_ns / kMirrorPeriodNs;
  if (!rows.has_state || slot <= vehicle->second.mirrored_slot) return;
  vehicle->second.mirrored_slot = slot;
  mirror(rows, time_ns);
}

void McapSink::mirror(const StepRows& rows, std::int64_t time_ns) {
  const model::Measurement& motion = rows.truth;
  ros::VehicleSample sample;
  sample.vehicle_id = rows.vehicle_id;
  sample.step = rows.step;
  sample.sim_time_ns = time_ns;
  sample.p_WQ = motion.p_WQ;
  sample.v_WQ = motion.v_WQ;
  sample.p_WL = motion.p_WL;
  sample.v_WL = motion.v_WL;
  if (rows.has_attitude) {
    sample.q_WB = motion.attitude.q_WB;
    sample.w_WB_B = motion.attitude.w_WB_B;
  }
  if (rows.has_reference) sample.reference = rows.answer.reference.position;
  sample.signals.assign(motion.signals.begin(), motion.signals.end());
  mirrors_.emit(sample, emit_);
}

void McapSink::write_mirror(std::size_t channel, std::int64_t time_ns,
                            const std::vector<std::uint8_t>& message) {
  const std::uint16_t id = mirror_channels_.at(channel);
  if (id == kLeftOut) return;
  file_.add_message(id, 0, static_cast<std::uint64_t>(time_ns),
                    {reinterpret_cast<const char*>(message.data()), message.size()});
}

std::map<std::string, std::string> McapSink::list_versions() const {
  const Compression compression = describe_compression();
  return {{compression.library, compression.version}};
}

std::vector<RecordedFile> McapSink::finish() {
  file_.finish();
  return {{file_.path(), file_.messages(), false}};
}

}  // namespace sls::record
