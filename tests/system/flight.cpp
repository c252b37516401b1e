#include "tests/system/flight.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>

namespace sls::test {
namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::string field;
  std::istringstream stream(line);
  while (std::getline(stream, field, ',')) fields.push_back(field);
  if (!line.empty() && line.back() == ',') fields.emplace_back();
  return fields;
}

std::size_t count_lines(const std::filesystem::path& file) {
  const std::string text = read_file(file);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

Words make_command(const std::string& name, int domain, const Words& flags,
                   const std::string& qos_file) {
  const Words command = {program(name), "--domain", std::to_string(domain)};
  return command + (qos_file.empty() ? Words{} : Words{"--qos", qos_file}) + flags;
}

Words lossy(int percent) {
  return {"env", std::string("LD_PRELOAD=") + SLS_DROP_SHIM,
          "SLS_DROP_PERCENT=" + std::to_string(percent), "SLS_DROP_SEED=1"};
}

std::unique_ptr<Process> Programs::start(const std::string& name, const Words& flags,
                                         const Words& before, const std::string& qos_file) const {
  const auto own = options_.before.find(name);
  return std::make_unique<Process>(
      (own == options_.before.end() ? Words{} : own->second) + before +
      make_command(name, domain.number(), flags, qos_file.empty() ? options_.qos_file : qos_file));
}

std::string make_long_scenario(const TemporaryFolder& folder,
                               std::vector<std::pair<std::string, std::string>> changes) {
  changes.emplace_back("period_s: 0.004", "period_s: 0.002");
  changes.emplace_back("mission:", "record: { flush_s: 0.02 }\nmission:");
  return make_scenario(folder, changes, "figure_eight");
}

Flight::Flight(const std::string& scenario_file, const FlightOptions& options) : Programs(options) {
  const Words flags = {"--scenario", scenario_file};
  recorder = start("recorder", {"--out", recording()});
  server = start("sim_server", flags + options.server);
  client = start("control_client", flags + options.client);
}

void Flight::wait() {
  for (Process* process : {server.get(), client.get(), recorder.get()})
    EXPECT_TRUE(process->wait().has_value()) << outputs();
}

void Flight::expect_success() {
  test::expect_success({server.get(), client.get(), recorder.get()});
  ASSERT_TRUE(std::filesystem::exists(recording() / "manifest.json")) << outputs();
  EXPECT_TRUE(read_manifest(recording()).at("complete").get<bool>()) << outputs();
}

bool Flight::wait_for_steps(std::size_t steps) const {
  return wait_until([&] { return count_lines(recording() / "state.csv") > steps; });
}

std::string Flight::outputs() const {
  return server->output() + client->output() + recorder->output();
}

Table::Table(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  names_ = split(line);
  for (const auto& name : names_) columns_.emplace(name, columns_.size());
  while (std::getline(stream, line)) rows_.push_back(split(line));
}

std::size_t Table::find(const std::string& column) const {
  const auto found = columns_.find(column);
  if (found == columns_.end()) throw std::runtime_error("no column " + column);
  return found->second;
}

double Table::number(std::size_t row, const std::string& column) const {
  return std::strtod(text(row, column).c_str(), nullptr);
}

const std::string& Table::text(std::size_t row, const std::string& column) const {
  return rows_.at(row).at(find(column));
}

Eigen::Vector3d Table::position(std::size_t row, const std::string& prefix) const {
  return {number(row, prefix + "_x_m"), number(row, prefix + "_y_m"), number(row, prefix + "_z_m")};
}

bool Table::is_well_formed() const {
  return !columns_.empty() && std::all_of(rows_.begin(), rows_.end(), [this](const auto& row) {
    return row.size() == columns_.size();
  });
}

nlohmann::json read_manifest(const std::filesystem::path& recording) {
  return nlohmann::json::parse(read_file(recording / "manifest.json"));
}

std::string read_certificate(const std::filesystem::path& recording) {
  return read_manifest(recording).at("certificate").get<std::string>();
}

std::filesystem::path fly_in_process(const std::string& scenario_file,
                                     const std::filesystem::path& recording,
                                     const std::vector<std::string>& flags) {
  expect_exit(Words{program("closed_loop"), "--scenario", scenario_file, "--out", recording} +
              flags);
  return recording;
}

void expect_undisturbed(const std::filesystem::path& recording, const std::string& scenario_file,
                        const std::vector<std::string>& flags) {
  const TemporaryFolder folder;
  const auto alone = fly_in_process(scenario_file, folder / "alone", flags);
  expect_exit({program("sls_verify"), recording, alone});
}

std::string make_qos_with_history(const TemporaryFolder& folder, const std::string& base,
                                  const std::string& batches) {
  const std::string endpoints = read_file(qos("endpoints")), end = "</data_writer>";
  const auto from = endpoints.find("<data_writer profile_name=\"sls_record_writer\">");
  std::string profile = endpoints.substr(from, endpoints.find(end, from) + end.size() - from);
  for (auto at = profile.find("5000<"); at != profile.npos; at = profile.find("5000<"))
    profile.replace(at, 4, batches);
  const std::string file = folder / "small_history.xml";
  write_bytes(file,
              replace_once(read_file(qos(base)), "\n  </profiles>", profile + "\n  </profiles>"));
  return file;
}

TrackingError calc_tracking_error(const std::filesystem::path& recording, std::size_t first,
                                  std::size_t last) {
  const Table states(recording / "state.csv"), references(recording / "reference.csv");
  std::map<std::size_t, std::size_t> rows;  // of references; unanswered steps may have none
  for (std::size_t row = 0; row < references.rows(); ++row)
    rows[static_cast<std::size_t>(references.number(row, "step"))] = row;
  TrackingError error;
  for (std::size_t step = first; step <= last; ++step) {
    const Eigen::Vector3d e =
        states.position(step, "load") - references.position(rows.at(step), "ref");
    error.rms += e.cwiseAbs2();
    error.max = error.max.cwiseMax(e.cwiseAbs());
  }
  error.rms = (error.rms / static_cast<double>(last - first + 1)).cwiseSqrt();
  return error;
}

}  // namespace sls::test
