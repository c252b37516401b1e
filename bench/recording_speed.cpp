#include "bench/recording_speed.hpp"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "closed_loop/samples.hpp"
#include "common/app/run_main.hpp"
#include "common/bus/convert.hpp"
#include "common/config/sha256.hpp"
#include "common/model/forces.hpp"
#include "recorder/columns.hpp"
#include "recorder/recording.hpp"

namespace sls::bench {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kRunId = 1;
constexpr std::array<const char*, 4> kFiles = {"state.csv", "command.csv", "reference.csv",
                                               "flight.csv"};

double calc_seconds(Clock::time_point from) {
  return std::chrono::duration<double>(Clock::now() - from).count();
}

/// A new folder, removed at the end.
class ScratchFolder {
 public:
  explicit ScratchFolder(const fs::path& parent)
      : path_(parent / fmt::format("sls-bench-{}", Clock::now().time_since_epoch().count())) {
    fs::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  const fs::path path_;
};

/// A row of flight.csv as the numbers that it holds.
using FlightRow = std::array<double, 23>;

FlightRow make_flight_row(const record::StepRows& rows) {
  const Eigen::Vector3d f_Q_W = bus::to_vector(rows.command->f_Q_W);
  const auto attitude = model::calc_commanded_attitude(f_Q_W);
  const auto& state = *rows.state;
  const Eigen::Vector3d n_W =
      (bus::to_vector(state.p_WL) - bus::to_vector(state.p_WQ)).normalized();
  const auto& ref = rows.reference->position();
  return {state.sim_time_s, ref[0],        ref[1],        ref[2],          state.p_WQ[0],
          state.p_WQ[1],    state.p_WQ[2], attitude.roll, attitude.pitch,  attitude.yaw,
          state.v_WQ[0],    state.v_WQ[1], state.v_WQ[2], n_W.x(),         n_W.y(),
          n_W.z(),          state.alpha,   state.beta,    state.alpha_dot, state.beta_dot,
          f_Q_W.x(),        f_Q_W.y(),     f_Q_W.z()};
}

/// A CSV file with what the C library has for buffering.
class PlainFile {
 public:
  PlainFile(const fs::path& path, std::string_view header) {
    file_.reset(std::fopen(path.c_str(), "wb"));
    if (!file_) throw app::RunError(path.string() + ": cannot write");
    std::setvbuf(file_.get(), nullptr, _IOFBF, 1 << 18);
    std::fwrite(header.data(), 1, header.size(), file_.get());
    std::fputc('\n', file_.get());
  }
  template <class Number>
  void operator()(const Number& number) {
    end_ = std::to_chars(end_, row_.data() + row_.size(), number).ptr;
    *end_++ = ',';
  }
  void operator()(const std::string& text) {
    end_ = std::copy(text.begin(), text.end(), end_);
    *end_++ = ',';
  }
  template <class Field>
  void incidental(const Field& field) {
    (*this)(field);
  }
  void end_row() {
    end_[-1] = '\n';
    std::fwrite(row_.data(), 1, static_cast<std::size_t>(end_ - row_.data()), file_.get());
    end_ = row_.data();
  }
  void close() { file_.reset(); }

 private:
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{nullptr, &std::fclose};
  std::array<char, 1024> row_;
  char* end_ = row_.data();
};

template <class Row>
void write_plain(PlainFile& file, const Row& row) {
  Row::visit(row, file);
  file.end_row();
}

double write_plain_files(std::vector<record::StepRows> steps, std::uint32_t vehicles,
                         const fs::path& folder) {
  std::vector<FlightRow> flight_rows;
  for (const auto& rows : steps) flight_rows.push_back(make_flight_row(rows));
  const auto began = Clock::now();
  PlainFile states(folder / kFiles[0], record::StateRow::kHeader);
  PlainFile commands(folder / kFiles[1], record::CommandRow::kHeader);
  PlainFile references(folder / kFiles[2], record::ReferenceRow::kHeader);
  PlainFile flight(folder / kFiles[3], record::make_flight_header(vehicles > 1));
  for (std::size_t i = 0; i < steps.size(); ++i) {
    record::StepRows& rows = steps[i];
    for (std::uint32_t id = 0; id < vehicles; ++id) {
      rows.state->vehicle_id = rows.command->vehicle_id = rows.reference->vehicle_id = id;
      write_plain(states, *rows.state);
      write_plain(references, *rows.reference);
      for (const double number : flight_rows[i]) flight(number);
      if (vehicles > 1) flight(id);
      flight.end_row();
      write_plain(commands, *rows.command);
    }
  }
  for (PlainFile* file : {&states, &commands, &references, &flight}) file->close();
  return calc_seconds(began);
}

/// What a lockstep run brings, in its order.
void feed(record::Recording& recording, std::vector<closed_loop::StepSamples>& samples,
          std::uint32_t vehicles) {
  for (closed_loop::StepSamples& step : samples) {
    for (std::uint32_t id = 0; id < vehicles; ++id) {
      step.state.vehicle_id(id);
      recording.add(step.state);
    }
    for (std::uint32_t id = 0; id < vehicles; ++id) {
      step.reference.vehicle_id(id);
      step.command.vehicle_id(id);
      recording.add(step.reference);
      recording.add(step.command);
    }
    recording.flush_if_due();
  }
}

}  // namespace

nlohmann::json measure_recording(const config::Scenario& scenario, std::uint32_t vehicles,
                                 std::size_t steps, const fs::path& folder) {
  std::vector<closed_loop::StepSamples> samples = closed_loop::fly_samples(scenario, steps, kRunId);
  samples.back().command.mission(MISSION_FINISHED);
  const ScratchFolder ours(folder), plain(folder);
  nlohmann::json json;
  json["rows"] = kFiles.size() * samples.size() * vehicles;
  {
    record::Recording recording(ours.path(),
                                closed_loop::make_parameters(scenario, kRunId, vehicles));
    recording.add(closed_loop::make_status(kRunId, 0, PHASE_RUNNING, 0));
    auto began = Clock::now();
    feed(recording, samples, vehicles);
    recording.add(closed_loop::make_status(kRunId, 1, PHASE_FINISHED, samples.size() - 1));
    json["recording_s"] = calc_seconds(began);
    began = Clock::now();
    if (!recording.finish("", 0)) throw app::RunError("recording: " + recording.describe_gaps());
    json["finish_s"] = calc_seconds(began);
  }
  std::vector<record::StepRows> rows;
  for (const closed_loop::StepSamples& step : samples) {
    record::StepRecord record;
    record.step = step.state.step();
    record.state = step.state;
    record.command = step.command;
    record.reference = step.reference;
    rows.push_back(record::make_rows(0, record));
  }
  json["plain_s"] = write_plain_files(std::move(rows), vehicles, plain.path());
  std::uintmax_t bytes = 0;
  for (const char* file : kFiles) {
    bytes += fs::file_size(ours.path() / file);
    if (config::calc_file_sha256(ours.path() / file) !=
        config::calc_file_sha256(plain.path() / file))
      throw app::RunError(std::string(file) + ": the plain file differs from the recording's");
  }
  json["bytes"] = bytes;
  return json;
}

}  // namespace sls::bench
