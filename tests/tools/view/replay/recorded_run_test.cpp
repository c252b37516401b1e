#include "tools/view/replay/recorded_run.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <sstream>

#include "common/config/config_error.hpp"
#include "recorder/sinks/csv/csv_reader.hpp"
#include "tests/recorder/csv_table.hpp"
#include "tests/recorder/flights.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/text.hpp"
#include "tests/tools/view/live/server_thread.hpp"
#include "tests/tools/view/replay/packed_run.hpp"
#include "tools/view/replay/shown_recording.hpp"
#include "tools/view/run_description.hpp"

namespace sls::view {
namespace {

namespace fs = std::filesystem;
using record::test::CsvTable;
using record::test::kLastStep;
using record::test::parse_csv;
using sls::test::read_bytes;
using sls::test::replace_once;
using sls::test::write_bytes;
using test::PackedRun;
using test::unpack;

constexpr std::size_t kPlenty = 64 << 20;

class RecordedRunTest : public ::testing::Test {
 protected:
  fs::path record(const std::string& name, const Parameters& parameters,
                  const std::function<void(RecordEntry&)>& disturb = {}) {
    fs::create_directory(folder_ / name);
    record::test::record_flight(folder_ / name, disturb, parameters);
    return folder_ / name;
  }
  fs::path record(const std::string& name = "flight") {
    return record(name, record::test::make_parameters());
  }
  std::string find_error(const fs::path& folder, std::size_t most_bytes = kPlenty) {
    return sls::test::find_error<std::runtime_error>(
        [&] { load_recorded_run(folder, most_bytes); });
  }
  void edit(const fs::path& file, const std::string& from, const std::string& to) {
    write_bytes(file, replace_once(read_bytes(file), from, to));
  }

  sls::test::TemporaryFolder folder_;
};

/// Expects that every row of `vehicle` equals the CSV row of the same time, rounded to float.
void expect_same(const PackedRun& run, std::uint32_t vehicle, const fs::path& file,
                 const std::vector<std::string>& columns) {
  const CsvTable table = parse_csv(read_bytes(file));
  std::map<double, std::size_t> places;
  for (std::size_t row = 0; row < table.rows.size(); ++row)
    if (table.number(row, "vehicle_id") == vehicle) places[table.number(row, "sim_time_s")] = row;
  const auto& packed = run.vehicles.at(vehicle);
  for (std::size_t i = 0; i < packed.times.size(); ++i) {
    ASSERT_EQ(places.count(packed.times[i]), 1u) << packed.times[i];
    for (const std::string& column : columns)
      ASSERT_EQ(packed.rows[i][run.find_column(column)],
                static_cast<float>(table.number(places.at(packed.times[i]), column)))
          << column << " at " << packed.times[i];
  }
}

TEST_F(RecordedRunTest, EveryRowEqualsTheCsvFiles) {
  const fs::path folder = record();
  const PackedRun run = unpack(load_recorded_run(folder, kPlenty));
  ASSERT_EQ(run.vehicles.at(0).times.size(), kLastStep + 1);
  EXPECT_EQ(run.head.at("every"), 1);
  EXPECT_EQ(run.head.at("steps_total"), kLastStep + 1);
  EXPECT_EQ(run.head.at("name"), "flight");
  EXPECT_EQ(run.head.at("complete"), true);
  EXPECT_EQ(run.head.at("outcome"), "finished: mission finished");
  expect_same(run, 0, folder / "state.csv",
              {"quad_x_m", "quad_vz_m_s", "load_y_m", "load_vx_m_s", "alpha_rad", "beta_dot_rad_s",
               "force_x_n", "force_z_n"});
  expect_same(run, 0, folder / "reference.csv", {"ref_x_m", "ref_y_m", "ref_z_m"});
  // A point mass has no attitude.
  for (const char* column : {"att_w", "att_z", "rate_x_rad_s", "rate_z_rad_s"})
    EXPECT_TRUE(std::isnan(run.vehicles.at(0).rows[7][run.find_column(column)])) << column;
}

TEST_F(RecordedRunTest, AttitudeAndSignalsFollow) {
  const fs::path folder = record("six", record::test::make_signal_parameters());
  const PackedRun run = unpack(load_recorded_run(folder, kPlenty));
  expect_same(run, 0, folder / "state.csv",
              {"att_w", "att_x", "att_z", "rate_y_rad_s", "tension_n", "wind"});
  EXPECT_EQ(run.head.at("run").at("columns").back().at("name"), "wind");
  EXPECT_EQ(run.find_column("tension_n"), kColumns.size());
}

TEST_F(RecordedRunTest, ThinningKeepsFirstAndLastAndTheBudget) {
  const fs::path folder = record();
  const std::size_t whole = load_recorded_run(folder, kPlenty).size();
  const std::size_t rows = (kLastStep + 1) * (8 + 4 * kColumns.size());
  const std::size_t head = whole - rows;
  for (const double share : {0.9, 0.5, 0.34, 0.2, 0.11}) {
    const auto most = head + static_cast<std::size_t>(share * static_cast<double>(rows));
    const std::string bytes = load_recorded_run(folder, most);
    EXPECT_LE(bytes.size(), most);
    const PackedRun run = unpack(bytes);
    const auto& times = run.vehicles.at(0).times;
    const std::uint64_t every = run.head.at("every");
    EXPECT_GT(every, 1u);
    ASSERT_GE(times.size(), 2u);
    EXPECT_EQ(times.front(), 0);
    EXPECT_EQ(times.back(), 1.2);
    for (std::size_t i = 0; i + 1 < times.size(); ++i)
      EXPECT_DOUBLE_EQ(times[i], static_cast<double>(i * every) * 0.004);
    // No more steps than necessary are left out: the next finer spacing would not fit.
    EXPECT_GT(bytes.size() - head, (most - head) * 45 / 100);
    expect_same(run, 0, folder / "state.csv", {"quad_x_m", "load_z_m"});
    EXPECT_EQ(run.head.at("steps_total"), kLastStep + 1);
  }
}

TEST_F(RecordedRunTest, ABudgetThatHoldsNoFlightIsRefused) {
  const fs::path folder = record();
  for (const std::size_t most : {0u, 1u, 100u, 700u})
    EXPECT_NE(find_error(folder, most)
                  .find("expected a recording whose first and last steps take "
                        "at most " +
                        std::to_string(most) + " bytes"),
              std::string::npos);
}

TEST_F(RecordedRunTest, EachVehicleOfAFleetHasItsRows) {
  Parameters parameters = record::test::make_parameters();
  record::test::set_vehicles(parameters, {0, 2});
  parameters.scenario_text(std::string("vehicles: 3\n") + record::test::kScenarioText);
  const fs::path folder = folder_ / "fleet";
  fs::create_directory(folder);
  {
    record::Recording recording(folder, parameters);
    record::test::BatchFeeder feeder(recording);
    for (std::uint64_t step = 0; step <= kLastStep; ++step) {
      RecordEntry other = record::test::make_entry(step, 2);
      other.truth().p_WQ_m()[0] += 5;
      feeder.add({record::test::make_entry(step), other}, step == kLastStep);
    }
    record::test::finish_flight(recording);
  }
  const std::string bytes = load_recorded_run(folder, kPlenty);
  const PackedRun run = unpack(bytes);
  ASSERT_EQ(run.vehicles.size(), 2u);
  for (const std::uint32_t id : {0u, 2u}) {
    EXPECT_EQ(run.vehicles.at(id).times.size(), kLastStep + 1);
    expect_same(run, id, folder / "state.csv", {"quad_x_m", "quad_y_m", "load_x_m"});
  }
  const PackedRun thin = unpack(load_recorded_run(folder, bytes.size() / 3));
  for (const std::uint32_t id : {0u, 2u}) {
    EXPECT_EQ(thin.vehicles.at(id).times.front(), 0);
    EXPECT_EQ(thin.vehicles.at(id).times.back(), 1.2);
    expect_same(thin, id, folder / "state.csv", {"quad_x_m"});
  }
}

TEST_F(RecordedRunTest, EventsStagesAndHeldStepsAreListed) {
  const fs::path folder = folder_ / "flight";
  fs::create_directory(folder);
  {
    record::Recording recording(folder, record::test::make_parameters());
    recording.add(
        record::test::make_status(RunPhase::PHASE_WAITING, 0, "waiting for: \"one\", two"));
    recording.add(record::test::make_status(RunPhase::PHASE_RUNNING, 0));
    record::test::BatchFeeder feeder(recording);
    for (std::uint64_t step = 0; step <= kLastStep; ++step)
      feeder.add({step >= 50 && step < 60
                      ? record::test::make_unanswered_entry(step, AnswerKind::ANSWER_HELD)
                      : record::test::make_entry(step)},
                 step == kLastStep);
    record::test::finish_flight(recording);
  }
  const auto head = unpack(load_recorded_run(folder, kPlenty)).head;
  const auto has_event = [&](std::uint64_t step, const std::string& text) {
    for (const auto& event : head.at("events"))
      if (event.at("step") == step && event.at("text") == text) return true;
    return false;
  };
  EXPECT_TRUE(has_event(0, "waiting: waiting for: \"one\", two")) << head.at("events");
  EXPECT_TRUE(has_event(0, "running"));
  EXPECT_TRUE(has_event(kLastStep, "finished: mission finished"));
  // flight.txt has the same events, and those that the recorder detected.
  EXPECT_EQ(head.at("events").size(), 3u + (head.at("complete") ? 0u : 1u)) << head.at("events");

  ASSERT_EQ(head.at("stage_starts").size(), 2u);
  EXPECT_EQ(head.at("stage_starts")[1],
            nlohmann::json({{"vehicle", 0}, {"sim_time_s", 0.4}, {"name", "figure_eight"}}));
  ASSERT_EQ(head.at("faults").size(), 1u) << head.at("faults");
  EXPECT_EQ(head.at("faults")[0].at("kind"), "held");
  EXPECT_DOUBLE_EQ(head.at("faults")[0].at("from_s"), 0.2);
  EXPECT_DOUBLE_EQ(head.at("faults")[0].at("to_s"), 0.24);
}

TEST_F(RecordedRunTest, FaultsOfTheScenarioAreIntervals) {
  Parameters parameters = record::test::make_parameters();
  parameters.scenario_text(std::string(record::test::kScenarioText) +
                           "faults:\n"
                           "  - bias: { on: command, force_n: [0, 1, 0], from_s: 0.5, to_s: 0.6 }\n"
                           "  - delay: { on: state, by_s: 0.02, from_s: 1 }\n"
                           "  - freeze: { on: state, from_s: 7 }\n");
  const auto faults =
      unpack(load_recorded_run(record("faulty", parameters), kPlenty)).head.at("faults");
  ASSERT_EQ(faults.size(), 2u) << faults;  // the third begins after the end
  EXPECT_EQ(
      faults[0],
      nlohmann::json(
          {{"from_s", 0.5}, {"to_s", 0.6}, {"kind", "bias"}, {"on", "command"}, {"vehicle", 0}}));
  EXPECT_EQ(faults[1].at("to_s"), 1.2);
}

// Three steps from a recorder of contract 1; the corpus of the fuzzer has four of its files. Its
// state.csv has no attitude, and its manifest has neither signals nor stage starts.
TEST_F(RecordedRunTest, ARecordingOfContract1Opens) {
  const fs::path folder = folder_ / "old";
  fs::create_directory(folder);
  std::istringstream corpus(read_bytes(SLS_SOURCE_DIR "/tests/fuzz/corpus/recording/three_steps"));
  for (const char* name : {"manifest.json", "state.csv", "command.csv", "reference.csv"}) {
    std::string bytes;
    std::getline(corpus, bytes, '\x1e');
    write_bytes(folder / name, bytes);
  }
  EXPECT_NE(find_error(folder).find("scenario.yaml: expected the recording's scenario"),
            std::string::npos);
  fs::copy(SLS_SOURCE_DIR "/config/scenarios/short.yaml", folder / "scenario.yaml");
  // Status samples of contract 1 have fewer counters.
  write_bytes(folder / "status.csv",
              "sample_index,phase,reason,step,controller,real_time_factor,resent,late\n"
              "0,waiting,waiting for: recorder,0,,0,0,0\n1,running,,0,,0,0,0\n");
  const PackedRun run = unpack(load_recorded_run(folder, kPlenty));
  ASSERT_EQ(run.vehicles.at(0).times, (std::vector<double>{0, 0.004, 0.008}));
  EXPECT_EQ(run.head.at("complete"), true);
  EXPECT_EQ(run.head.at("run").at("has_attitude"), false);
  EXPECT_EQ(run.head.at("events").size(), 2u);
  expect_same(run, 0, folder / "state.csv", {"quad_x_m", "load_vz_m_s", "force_z_n"});
}

TEST_F(RecordedRunTest, ASegmentTakesOverFromTheOneBefore) {
  const fs::path folder = folder_ / "flight";
  fs::create_directory(folder);
  record::test::record_until_killed(record::test::make_segment(folder), 0, 200);
  const PackedRun cut = unpack(load_recorded_run(folder, kPlenty));
  EXPECT_EQ(cut.head.at("complete"), false);
  EXPECT_EQ(cut.head.at("outcome"), "its recorder was killed, or is still recording");
  EXPECT_GT(cut.vehicles.at(0).times.size(), 2u);

  const record::Segment next = record::make_next_segment(record::open_recording(folder));
  {
    record::Recording recording(next, record::test::make_parameters());
    record::test::add_steps(recording, next.first_step, kLastStep);
    record::test::finish_flight(recording);
  }
  const PackedRun run = unpack(load_recorded_run(folder, kPlenty));
  const auto& times = run.vehicles.at(0).times;
  ASSERT_EQ(times.size(), kLastStep + 1);
  for (std::size_t i = 0; i < times.size(); ++i)
    EXPECT_DOUBLE_EQ(times[i], static_cast<double>(i) * 0.004);
}

TEST_F(RecordedRunTest, ARowThatIsCutOffAtTheEndIsNoRow) {
  const fs::path folder = record();
  const std::string state = read_bytes(folder / "state.csv");
  write_bytes(folder / "state.csv", state.substr(0, state.size() - 20));
  EXPECT_EQ(unpack(load_recorded_run(folder, kPlenty)).vehicles.at(0).times.size(), kLastStep);
}

TEST_F(RecordedRunTest, DamageIsNamedInOneLine) {
  const auto damage = [&](const std::string& name, auto change) {
    fs::remove_all(folder_ / "flight");
    const fs::path folder = record();
    change(folder / name);
    const std::string error = find_error(folder);
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    return error;
  };
  const auto remove = [](const fs::path& file) { fs::remove(file); };
  for (const char* name : {"state.csv", "command.csv", "reference.csv", "scenario.yaml"})
    EXPECT_NE(damage(name, remove).find(name), std::string::npos) << name;
  EXPECT_NE(damage("manifest.json", remove).find("expected a recording, got no manifest.json"),
            std::string::npos);
  EXPECT_EQ(damage("status.csv", remove), "no error");  // no events
  EXPECT_EQ(damage("flight.txt", remove), "no error");
  EXPECT_EQ(damage("flight.txt",
                   [](const fs::path& file) { fs::remove(file), ::mkfifo(file.c_str(), 0600); }),
            "no error");
  const auto extend = [](const fs::path& file) { fs::resize_file(file, std::uintmax_t{1} << 40); };
  EXPECT_EQ(damage("flight.txt", extend), "no error");
  EXPECT_NE(damage("state.csv",
                   [](const fs::path& file) {
                     const std::string bytes = read_bytes(file);
                     const auto middle = bytes.find('\n', bytes.size() / 2);
                     write_bytes(file, bytes.substr(0, middle - 30) + bytes.substr(middle));
                   })
                .find("state.csv:"),
            std::string::npos);
  EXPECT_NE(
      damage("manifest.json",
             [&](const fs::path& file) { edit(file, "\"period_s\": 0.004", "\"period_s\": 0"); })
          .find("period_s: expected > 0, got 0"),
      std::string::npos);
  EXPECT_NE(damage("manifest.json",
                   [&](const fs::path& file) { edit(file, "0123456789abcdef", "<script>"); })
                .find("run_id: expected 16 hex digits"),
            std::string::npos);
  EXPECT_NE(damage("scenario.yaml", [](const fs::path& file) { write_bytes(file, "- 7\n"); })
                .find("scenario.yaml"),
            std::string::npos);
  EXPECT_NE(damage("scenario.yaml",
                   [](const fs::path& file) { write_bytes(file, std::string(1 << 20, '#')); })
                .find("expected at most 32768 bytes"),
            std::string::npos);
}

class ShownRecordingTest : public RecordedRunTest {
 protected:
  /// The steps of the recording of `run_id` in `folder`, or why there are none.
  std::string ask(const fs::path& folder, std::uint64_t run_id, bool is_over = false) {
    sls::test::ServerThread thread;
    ShownRecording shown(folder, thread.post());
    std::string answer;
    int answers = 0;
    const auto note = [&](bool is_there, const auto& bytes) {
      answer = is_there ? std::to_string(unpack(*bytes).vehicles.at(0).times.size()) : *bytes;
      ++answers;
    };
    for (int i = 0; i < 3; ++i) shown.ask(run_id, is_over, note);
    EXPECT_TRUE(thread.wait_until([&] { return answers == 3 && shown.is_idle(); }));
    return answer;
  }
};

TEST_F(ShownRecordingTest, IsFoundByItsRunOrTheReasonIsNamed) {
  constexpr std::uint64_t kRun = 0x0123456789abcdef;
  const fs::path flight = record();
  edit(record("another") / "manifest.json", "0123456789abcdef", "00000000000000aa");
  write_bytes(record("damaged") / "manifest.json", "{");
  const std::string all = std::to_string(kLastStep + 1);
  EXPECT_EQ(ask(flight, kRun), all);
  EXPECT_EQ(ask(folder_.path(), kRun, true), all);
  const std::string wanted = ": expected the recording of run 0123456789abcdef, ";
  for (const auto& [folder, problem] : {std::pair(folder_ / "another", "got none"),
                                        std::pair(folder_ / "none", "No such file or directory"),
                                        std::pair(fs::path("/dev/null"), "Not a directory")})
    EXPECT_EQ(ask(folder, kRun), folder.string() + wanted + problem);
  fs::remove(flight / "state.csv");
  EXPECT_NE(ask(flight, kRun).find("state.csv"), std::string::npos);
}

TEST_F(ShownRecordingTest, OfARunThatGoesOnHasTheStepsUntilNow) {
  const fs::path folder = folder_ / "flight";
  fs::create_directory(folder);
  record::Recording recording(folder, record::test::make_parameters());
  record::test::add_steps(recording, 0, 99);
  while (read_bytes(folder / "state.csv").size() < 9'000) recording.flush_if_due();
  EXPECT_EQ(ask(folder_.path(), 0x0123456789abcdef), "100");
}

TEST_F(RecordedRunTest, AFolderOfAnotherKindIsRefused) {
  EXPECT_NE(find_error(folder_ / "none").find("expected a recording"), std::string::npos);
  EXPECT_NE(find_error(folder_.path()).find("expected a recording"), std::string::npos);
  EXPECT_NE(find_error("/dev/null").find("expected a recording"), std::string::npos);
}

TEST_F(RecordedRunTest, IdsThatTheScenarioDoesNotHaveAreRefused) {
  const fs::path folder = record();
  const std::string manifest = read_bytes(folder / "manifest.json");
  const auto begin = manifest.find('[', manifest.find("\"vehicle_ids\"")) + 1;
  const auto end = manifest.find(']', begin);
  write_bytes(folder / "manifest.json", std::string(manifest).replace(begin, end - begin, "9"));
  EXPECT_NE(
      find_error(folder).find("vehicle_ids: expected ids of the scenario's 1 vehicles, got 9"),
      std::string::npos);
  write_bytes(folder / "manifest.json", std::string(manifest).replace(begin, end - begin, ""));
  EXPECT_NE(find_error(folder).find("vehicle_ids: expected at least one"), std::string::npos);
}

// Steps that are far apart must not cause a loop over all steps between them.
TEST_F(RecordedRunTest, StepNumbersThatNoFlightHasDoNoHarm) {
  const fs::path folder = record();
  const std::string row = "0,0,0,0,0,-1.5,0,0,0,0,0,-0.5,0,0,0,0,0,0,0,0,0,0\n";
  const std::string header = read_bytes(folder / "state.csv");
  std::string bytes = header.substr(0, header.find('\n') + 1);
  for (std::uint64_t i = 0; i < 5000; ++i)
    bytes += "0," + std::to_string(i << 38) + "," + std::to_string(i) + row.substr(5);
  write_bytes(folder / "state.csv", bytes);
  const std::size_t head = load_recorded_run(folder, kPlenty).size() - 5000 * (8 + 29 * 4);
  const PackedRun run = unpack(load_recorded_run(folder, head + 100'000));
  EXPECT_EQ(run.vehicles.at(0).times.back(), 4999);
  write_bytes(folder / "state.csv", bytes + "0,1152921504606846976,5000" + row.substr(5));
  EXPECT_NE(find_error(folder).find("step: expected one below"), std::string::npos);
}

}  // namespace
}  // namespace sls::view
