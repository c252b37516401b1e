// Records a whole run with Recording and checks the files alone (design 9).
#include "recorder/recording.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "common/app/version.hpp"
#include "common/text/sha256.hpp"
#include "tests/recorder/csv_table.hpp"
#include "tests/recorder/file_size_limit.hpp"
#include "tests/recorder/flights.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;
using namespace test;
using sls::test::read_bytes;
using Json = nlohmann::json;

constexpr const char* kCsvFiles[] = {"state.csv", "command.csv", "reference.csv", "status.csv",
                                     "flight.csv"};

class RecordingTest : public testing::Test {
 protected:
  RecordingTest() : recording_(std::make_unique<Recording>(folder_.path(), make_parameters())) {}

  void add_steps(std::uint64_t from, std::uint64_t to) { feeder_.add_steps(from, to); }
  void fly_to_the_end() {
    recording_->add(make_status(RunPhase::PHASE_RUNNING, 0));
    add_steps(0, kLastStep);
    recording_->add(make_status(RunPhase::PHASE_FINISHED, kLastStep, "mission finished"));
  }
  bool finish(const std::string& interruption = "", std::uint64_t refused = 0) {
    return recording_->finish(interruption, refused);
  }

  CsvTable read_table(const std::string& name) {
    const CsvTable table = parse_csv(read_bytes(folder_ / name));
    EXPECT_TRUE(table.is_whole) << name;
    for (const auto& row : table.rows) EXPECT_EQ(row.size(), table.header.size()) << name;
    return table;
  }
  Json read_manifest() { return Json::parse(read_bytes(folder_ / "manifest.json")); }
  std::string read_header(const std::string& name) {
    const std::string bytes = read_bytes(folder_ / name);
    return bytes.substr(0, bytes.find('\n'));
  }

  const sls::test::TemporaryFolder folder_;
  std::unique_ptr<Recording> recording_;
  BatchFeeder feeder_{*recording_};
};

// --- a run that finished -------------------------------------------------------------------------

TEST_F(RecordingTest, AWholeRunIsComplete) {
  EXPECT_FALSE(recording_->has_all());
  EXPECT_EQ(recording_->last_complete_step(), -1);
  fly_to_the_end();
  EXPECT_TRUE(recording_->has_all());
  EXPECT_EQ(recording_->last_complete_step(), static_cast<std::int64_t>(kLastStep));
  EXPECT_TRUE(finish());
  const Json manifest = read_manifest();
  EXPECT_EQ(manifest.at("complete"), true);
  EXPECT_EQ(manifest.at("outcome"), "finished");
  EXPECT_EQ(manifest.at("missing"), Json::array());
  EXPECT_EQ(manifest.at("refused_samples"), 0);
  EXPECT_EQ(manifest.at("last_step"), kLastStep);
}

TEST_F(RecordingTest, ColumnsAreThoseOfTheDesign) {
  fly_to_the_end();
  finish();
  EXPECT_EQ(read_header("state.csv"),
            "vehicle_id,step,sim_time_s,quad_x_m,quad_y_m,quad_z_m,quad_vx_m_s,quad_vy_m_s,"
            "quad_vz_m_s,load_x_m,load_y_m,load_z_m,load_vx_m_s,load_vy_m_s,load_vz_m_s,"
            "alpha_rad,beta_rad,alpha_dot_rad_s,beta_dot_rad_s,force_x_n,force_y_n,force_z_n");
  EXPECT_EQ(read_header("reference.csv"),
            "vehicle_id,step,sim_time_s,stage,stage_name,ref_x_m,ref_y_m,ref_z_m,ref_vx_m_s,"
            "ref_vy_m_s,ref_vz_m_s,ref_ax_m_s2,ref_ay_m_s2,ref_az_m_s2,ref_jx_m_s3,ref_jy_m_s3,"
            "ref_jz_m_s3,ref_sx_m_s4,ref_sy_m_s4,ref_sz_m_s4");
  EXPECT_EQ(read_header("flight.csv"),
            "sim_time_s,ref_x_m,ref_y_m,ref_z_m,quad_x_m,quad_y_m,quad_z_m,roll_rad,pitch_rad,"
            "yaw_rad,quad_vx_m_s,quad_vy_m_s,quad_vz_m_s,rod_x,rod_y,rod_z,alpha_rad,beta_rad,"
            "alpha_dot_rad_s,beta_dot_rad_s,force_x_n,force_y_n,force_z_n");
}

TEST_F(RecordingTest, EachFileHasARowPerStepInOrder) {
  fly_to_the_end();
  finish();
  for (const char* name : {"state.csv", "command.csv", "reference.csv"}) {
    const CsvTable table = read_table(name);
    ASSERT_EQ(table.rows.size(), kLastStep + 1) << name;
    for (std::uint64_t step = 0; step <= kLastStep; ++step) {
      ASSERT_EQ(table.text(step, "step"), std::to_string(step)) << name;
      ASSERT_EQ(table.text(step, "vehicle_id"), "0") << name;
    }
  }
  EXPECT_EQ(read_table("flight.csv").rows.size(), kLastStep + 1);
  EXPECT_EQ(read_table("status.csv").rows.size(), 2u);
}

TEST_F(RecordingTest, RowsHoldTheSamplesToTheBit) {
  fly_to_the_end();
  finish();
  const CsvTable states = read_table("state.csv"), commands = read_table("command.csv"),
                 references = read_table("reference.csv");
  const auto expect_vector = [](const CsvTable& table, std::size_t row, std::size_t first,
                                const std::array<double, 3>& values) {
    for (std::size_t i = 0; i < 3; ++i)
      ASSERT_EQ(std::stod(table.rows[row][first + i]), values[i]) << table.header[first + i];
  };
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    const RecordEntry entry = make_entry(step);
    const PlantState& state = entry.truth();
    EXPECT_EQ(states.number(step, "sim_time_s"), static_cast<double>(4 * step) / 1000.0);
    expect_vector(states, step, states.find_column("quad_x_m"), state.p_WQ_m());
    expect_vector(states, step, states.find_column("quad_vx_m_s"), state.v_WQ_m_s());
    expect_vector(states, step, states.find_column("load_x_m"), state.p_WL_m());
    expect_vector(states, step, states.find_column("load_vx_m_s"), state.v_WL_m_s());
    EXPECT_EQ(states.number(step, "alpha_rad"), state.alpha_rad());
    EXPECT_EQ(states.number(step, "beta_rad"), state.beta_rad());
    EXPECT_EQ(states.number(step, "alpha_dot_rad_s"), state.alpha_dot_rad_s());
    EXPECT_EQ(states.number(step, "beta_dot_rad_s"), state.beta_dot_rad_s());
    expect_vector(states, step, states.find_column("force_x_n"), entry.f_Q_W_n());

    const ControlCommand& command = entry.answer();
    EXPECT_EQ(commands.text(step, "controller"), kPilot);
    expect_vector(commands, step, commands.find_column("force_x_n"), command.f_Q_W_n());
    EXPECT_EQ(commands.number(step, "compute_us"), static_cast<double>(12345 + step) / 1000.0);
    EXPECT_EQ(commands.text(step, "fault"), "none");

    const Reference& reference = command.reference();
    EXPECT_EQ(references.number(step, "sim_time_s"), static_cast<double>(4 * step) / 1000.0);
    EXPECT_EQ(references.text(step, "stage"), step < 100 ? "0" : "1");
    EXPECT_EQ(references.text(step, "stage_name"), step < 100 ? "hold" : "figure_eight");
    expect_vector(references, step, 5, reference.position_m());
    expect_vector(references, step, 8, reference.velocity_m_s());
    expect_vector(references, step, 11, reference.acceleration_m_s2());
    expect_vector(references, step, 14, reference.jerk_m_s3());
    expect_vector(references, step, 17, reference.snap_m_s4());
  }
}

TEST_F(RecordingTest, FlightRowsJoinTheStepAndTheirAttitudeReproducesTheForce) {
  fly_to_the_end();
  finish();
  const CsvTable flight = read_table("flight.csv"), commands = read_table("command.csv"),
                 states = read_table("state.csv"), references = read_table("reference.csv");
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    for (const char* column : {"force_x_n", "force_y_n", "force_z_n"})
      ASSERT_EQ(flight.text(step, column), commands.text(step, column));
    for (const char* column : {"ref_x_m", "ref_y_m", "ref_z_m", "sim_time_s"})
      ASSERT_EQ(flight.text(step, column), references.text(step, column));
    for (const char* column :
         {"quad_x_m", "quad_y_m", "quad_z_m", "quad_vx_m_s", "quad_vy_m_s", "quad_vz_m_s",
          "alpha_rad", "beta_rad", "alpha_dot_rad_s", "beta_dot_rad_s"})
      ASSERT_EQ(flight.text(step, column), states.text(step, column));

    // F = −|F| R(roll, pitch, 0) e₃ with R = R_y(pitch) R_x(roll), third column written out.
    const double roll = flight.number(step, "roll_rad"), pitch = flight.number(step, "pitch_rad");
    EXPECT_EQ(flight.number(step, "yaw_rad"), 0.0);
    const Eigen::Vector3d force(flight.number(step, "force_x_n"), flight.number(step, "force_y_n"),
                                flight.number(step, "force_z_n"));
    const Eigen::Vector3d thrust_axis(std::sin(pitch) * std::cos(roll), -std::sin(roll),
                                      std::cos(pitch) * std::cos(roll));
    // Rounding of two angles and four products.
    EXPECT_LT((force + force.norm() * thrust_axis).norm(), 1e-14 * force.norm());

    // The rod vector: q = (sin β, −sin α cos β, cos α cos β).
    const double alpha = flight.number(step, "alpha_rad"), beta = flight.number(step, "beta_rad");
    const Eigen::Vector3d rod(flight.number(step, "rod_x"), flight.number(step, "rod_y"),
                              flight.number(step, "rod_z"));
    const Eigen::Vector3d expected(std::sin(beta), -std::sin(alpha) * std::cos(beta),
                                   std::cos(alpha) * std::cos(beta));
    EXPECT_LT((rod - expected).norm(), 1e-14);  // difference of positions of about 10 m
  }
}

TEST_F(RecordingTest, TheManifestDescribesTheRunTheMachineAndEveryFile) {
  fly_to_the_end();
  finish();
  const Json manifest = read_manifest();
  EXPECT_EQ(manifest.at("run_id"), "0123456789abcdef");
  EXPECT_EQ(manifest.at("scenario"), "synthetic");
  EXPECT_EQ(manifest.at("scenario_sha256"), text::calc_sha256(kScenarioText));
  EXPECT_EQ(manifest.at("vehicle_ids"), Json::array({0}));
  EXPECT_EQ(manifest.at("period_s"), 0.004);
  EXPECT_EQ(manifest.at("step_s"), 0.001);
  EXPECT_EQ(manifest.at("mode"), "lockstep");
  EXPECT_EQ(manifest.at("timing"), "exact");
  EXPECT_EQ(manifest.at("segment"), Json({{"number", 1}, {"first_step", 0}}));
  EXPECT_EQ(manifest.at("unanswered_steps"), 0);
  EXPECT_EQ(manifest.at("contract_sha256"), bus::kContractSha256);
  EXPECT_EQ(manifest.at("dropped"), Json({{"repeated", 0}, {"out_of_range", 0}}));
  EXPECT_FALSE(manifest.contains("libraries"));
  EXPECT_FALSE(manifest.contains("signals"));
  EXPECT_EQ(manifest.at("versions").at("sim_server"), "sls 0.0.test");
  EXPECT_FALSE(manifest.at("versions").at("recorder").get<std::string>().empty());
  EXPECT_FALSE(manifest.at("versions").at("fast_dds").get<std::string>().empty());
  EXPECT_NE(manifest.at("machine").at("libc").get<std::string>().find("glibc"), std::string::npos);
  EXPECT_TRUE(manifest.at("machine").contains("processor"));
  EXPECT_EQ(manifest.at("versions").at("eigen"), app::eigen_version());
  EXPECT_EQ(manifest.at("machine").at("system"), app::system_name());

  // The manifest lists all files and no others, each with its hash; CSV files also with their rows.
  std::set<std::string> there, listed;
  for (const auto& entry : fs::directory_iterator(folder_.path()))
    there.insert(entry.path().filename());
  for (const auto& [name, file] : manifest.at("files").items()) {
    listed.insert(name);
    EXPECT_EQ(file.at("sha256"), text::calc_file_sha256(folder_ / name)) << name;
    EXPECT_EQ(file.at("sha256"), text::calc_sha256(read_bytes(folder_ / name))) << name;
    if (name.find(".csv") != std::string::npos)
      EXPECT_EQ(file.at("rows"), read_table(name).rows.size()) << name;
    else
      EXPECT_FALSE(file.contains("rows")) << name;
  }
  listed.insert("manifest.json");
  EXPECT_EQ(listed, there);
  for (const char* name : kCsvFiles) EXPECT_EQ(listed.count(name), 1u) << name;
}

TEST(RecordingLibraryTest, LibrariesAreInTheManifest) {
  const sls::test::TemporaryFolder folder;
  Parameters parameters = make_parameters();
  parameters.library_sha256(std::string(64, 'a'));
  Recording recording(folder.path(), parameters);
  recording.note_library("pilot", std::string(64, 'b'));
  recording.note_library("standby", std::string(64, 'd'));
  recording.note_library("pilot", std::string(64, 'e'));  // ignored: the first hash stays
  recording.finish("interrupted", 0);
  EXPECT_EQ(Json::parse(read_bytes(folder / "manifest.json")).at("libraries"),
            Json({{"plant", std::string(64, 'a')},
                  {"controllers",
                   {{"pilot", std::string(64, 'b')}, {"standby", std::string(64, 'd')}}}}));
}

TEST_F(RecordingTest, TheScenarioIsKeptByteForByte) {
  EXPECT_EQ(read_bytes(folder_ / "scenario.yaml"), kScenarioText);
  EXPECT_EQ(text::calc_file_sha256(folder_ / "scenario.yaml"),
            make_parameters().scenario_sha256().to_string());
}

TEST_F(RecordingTest, FlightTextNamesTheOutcomeAndTheStages) {
  fly_to_the_end();
  finish();
  const std::string text = read_bytes(folder_ / "flight.txt");
  for (const char* part : {"synthetic: finished", "0 hold", "1 figure_eight", "lap 2", "Events"})
    EXPECT_NE(text.find(part), std::string::npos) << part;
}

TEST_F(RecordingTest, StatusRowsKeepReasonsWithCommasQuotesAndLineBreaksAndEveryCounter) {
  SimStatus status = make_status(RunPhase::PHASE_PAUSED, 7, "a, \"b\"\nc");
  status.problem("client 'x': run_id: expected 1, got 0");
  std::uint64_t count = 0;
  for (const bus::SyncCounter& counter : bus::kSyncCounters)
    (status.counters().*counter.change)() = ++count;
  recording_->add(status);
  finish();
  const CsvTable table = read_table("status.csv");
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.text(0, "phase"), "paused");
  EXPECT_EQ(table.text(0, "reason"), "a, \"b\"\nc");
  EXPECT_EQ(table.text(0, "step"), "7");
  EXPECT_EQ(table.text(0, "controller"), kPilot);
  int expected = 0;
  for (const char* column :
       {"resent", "late", "duplicate", "superseded", "take_overs", "rejected_not_finite",
        "rejected_force_limit", "rejected_run", "rejected_step", "rejected_vehicle",
        "rejected_client", "rejected_fault", "stale", "held", "fail_safe", "deadline_missed",
        "overflow", "slipped"})
    EXPECT_EQ(table.text(0, column), std::to_string(++expected)) << column;
  const std::string text = read_bytes(folder_ / "flight.txt");
  EXPECT_NE(
      text.find("Commands\n"
                "  states resent 1, duplicate 3, superseded 4, late 2, take-overs 5\n"
                "  stale 13, held 14, fail-safe 15, deadline missed 16, overflow 17, slipped 18\n"
                "  rejected: not finite 6, force limit 7, run 8, step 9, vehicle 10, client 11, "
                "fault 12\n"),
      text.npos)
      << text;
  EXPECT_EQ(table.text(0, "round_trip_p50_us"), "81.25");
  EXPECT_EQ(table.text(0, "round_trip_p99_us"), "140");
  EXPECT_EQ(table.text(0, "timing"), "exact");
  EXPECT_EQ(table.text(0, "problem"), "client 'x': run_id: expected 1, got 0");
  EXPECT_EQ(table.header.back(), "problem");
}

// --- missing samples are reported ----------------------------------------------------------------

TEST_F(RecordingTest, StepsLostInOneStretchAreListedAndMakeItIncomplete) {
  recording_->add(make_status(RunPhase::PHASE_RUNNING, 0));
  add_steps(0, 49);
  feeder_.add({make_entry(60)});
  add_steps(61, kLastStep);
  recording_->add(make_status(RunPhase::PHASE_FINISHED, kLastStep));
  EXPECT_TRUE(recording_->has_all()) << "what is lost is not waited for";
  EXPECT_FALSE(finish());
  const Json manifest = read_manifest();
  EXPECT_EQ(manifest.at("complete"), false);
  EXPECT_EQ(manifest.at("outcome"), "finished");
  const auto gap = [](const char* topic) {
    return Json({{"vehicle_id", 0}, {"topic", topic}, {"from", 50}, {"to", 59}});
  };
  EXPECT_EQ(manifest.at("missing"),
            Json::array({gap("sls/state"), gap("sls/command"), gap("sls/reference")}));
  for (const char* name : {"state.csv", "command.csv", "reference.csv", "flight.csv"})
    EXPECT_EQ(read_table(name).rows.size(), kLastStep + 1 - 10) << name;
  const std::string gaps = recording_->describe_gaps();
  EXPECT_NE(gaps.find("sls/state step 50"), std::string::npos) << gaps;
  EXPECT_NE(read_bytes(folder_ / "flight.txt").find("sls/state step 50"), std::string::npos);
}

// A network that loses steps for days.
TEST_F(RecordingTest, OfManyGapsTheFirstAreListedAndTheOthersCounted) {
  constexpr std::uint64_t kGaps = 3000;  // of one step, in each of three topics
  for (std::uint64_t i = 0; i < kGaps; ++i) feeder_.add({make_entry(2 * i + 1)});
  recording_->add(make_status(RunPhase::PHASE_FINISHED, 2 * kGaps - 1));
  EXPECT_FALSE(finish());
  const Json manifest = read_manifest();
  ASSERT_EQ(manifest.at("missing").size(), 1000u);
  EXPECT_EQ(manifest.at("missing").back().at("to"), 666);
  EXPECT_EQ(manifest.at("further_missing"),
            Json({{"gaps", 3 * kGaps - 1000}, {"samples", 3 * kGaps - 1000}}));
  const ManifestFile read = record::read_manifest(folder_.path());
  EXPECT_EQ(describe(read.missing), "9000 samples missing, first sls/state step 0 of vehicle 0");
  EXPECT_EQ(recording_->describe_gaps(), describe(read.missing));
}

TEST_F(RecordingTest, UnansweredStepsAreRowsAndNotMissing) {
  add_steps(0, 9);
  for (std::uint64_t step = 10; step < 20; ++step)
    feeder_.add({make_unanswered_entry(
        step, step < 15 ? AnswerKind::ANSWER_HELD : AnswerKind::ANSWER_FAIL_SAFE)});
  feeder_.add({make_late_entry(12)});
  EXPECT_EQ(recording_->last_complete_step(), 19) << "late answers may still come";
  add_steps(20, kLastStep);
  recording_->add(make_status(RunPhase::PHASE_FINISHED, kLastStep));
  EXPECT_TRUE(recording_->has_all());
  EXPECT_TRUE(finish());
  const Json manifest = read_manifest();
  EXPECT_EQ(manifest.at("unanswered_steps"), 10);
  EXPECT_EQ(manifest.at("missing"), Json::array());
  const CsvTable commands = read_table("command.csv"), references = read_table("reference.csv");
  ASSERT_EQ(commands.rows.size(), kLastStep + 1);
  for (std::uint64_t step = 10; step < 20; ++step) {
    EXPECT_EQ(commands.text(step, "fault"), step < 15 ? "held" : "fail_safe");
    EXPECT_EQ(commands.text(step, "controller"), kPilot);
    EXPECT_EQ(commands.text(step, "compute_us"), "0");
    EXPECT_EQ(commands.number(step, "force_x_n"),
              make_unanswered_entry(step, AnswerKind::ANSWER_HELD).answer().f_Q_W_n()[0]);
  }
  ASSERT_EQ(references.rows.size(), kLastStep + 1 - 9);
  EXPECT_EQ(references.text(10, "step"), "12");
  EXPECT_EQ(references.number(10, "ref_x_m"), make_entry(12).answer().reference().position_m()[0]);
  EXPECT_EQ(read_table("flight.csv").rows.size(), kLastStep + 1 - 9);
}

// --- attitude, signals, measurements -------------------------------------------------------------

TEST(SignalsTest, AttitudeRatesAndSignalsAreTheLastColumnsAndInTheManifest) {
  const sls::test::TemporaryFolder folder;
  record_flight(folder.path(), {}, make_signal_parameters());
  const CsvTable states = parse_csv(read_bytes(folder / "state.csv"));
  ASSERT_EQ(states.header.size(), 22u + 4 + 3 + 2);
  ASSERT_EQ(states.rows.size(), kLastStep + 1);
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    const PlantState truth = make_entry(step).truth();
    EXPECT_EQ(states.number(step, "att_w"), truth.q_WB()[0]);
    EXPECT_EQ(states.text(step, "att_z"), "-0");
    EXPECT_EQ(states.number(step, "rate_y_rad_s"), truth.w_WB_B_rad_s()[1]);
    EXPECT_EQ(states.number(step, "tension_n"), truth.signals()[0]);
    EXPECT_EQ(states.text(step, "wind"), "-7");
  }
  const Json manifest = Json::parse(read_bytes(folder / "manifest.json"));
  EXPECT_EQ(manifest.at("complete"), true);
  EXPECT_EQ(manifest.at("signals"), Json::array({{{"name", "tension_n"}, {"unit", "N"}},
                                                 {{"name", "wind"}, {"unit", ""}}}));
}

TEST(SignalsTest, RowsAlwaysHaveAsManyFieldsAsTheHeader) {
  const sls::test::TemporaryFolder folder;
  record_flight(
      folder.path(), [](RecordEntry& entry) { entry.truth().signals().resize(entry.step() % 5); },
      make_signal_parameters());
  const CsvTable states = parse_csv(read_bytes(folder / "state.csv"));
  for (const auto& row : states.rows) ASSERT_EQ(row.size(), states.header.size());
  EXPECT_EQ(states.text(0, "tension_n"), "nan");
}

TEST_F(RecordingTest, MeasurementsHaveTheirOwnFileFromTheFirstRow) {
  add_steps(0, 49);
  EXPECT_FALSE(fs::exists(folder_ / "measured.csv"));
  for (std::uint64_t step = 50; step <= kLastStep; ++step) {
    RecordEntry entry = make_entry(step);
    entry.measured({entry.truth()});
    entry.measured()[0].p_WQ_m()[0] += 1;
    feeder_.add({entry}, step == kLastStep);
  }
  recording_->add(make_status(RunPhase::PHASE_FINISHED, kLastStep));
  finish();
  const CsvTable measured = read_table("measured.csv"), states = read_table("state.csv");
  EXPECT_EQ(measured.header, states.header);
  ASSERT_EQ(measured.rows.size(), kLastStep + 1 - 50);
  for (std::size_t row = 0; row < measured.rows.size(); ++row) {
    EXPECT_EQ(measured.number(row, "quad_x_m"), states.number(row + 50, "quad_x_m") + 1);
    EXPECT_EQ(measured.text(row, "step"), states.text(row + 50, "step"));
    EXPECT_EQ(measured.text(row, "force_z_n"), states.text(row + 50, "force_z_n"));
  }
  EXPECT_EQ(read_manifest().at("files").at("measured.csv").at("rows"), measured.rows.size());
}

// --- runs that did not finish --------------------------------------------------------------------

TEST_F(RecordingTest, KilledBeforeTheEndItsFilesParseAndAreMarkedIncomplete) {
  recording_->add(make_status(RunPhase::PHASE_RUNNING, 0));
  add_steps(0, 149);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (read_table("state.csv").rows.empty() && std::chrono::steady_clock::now() < deadline)
    recording_->flush_if_due();  // at least every 0.2 s
  add_steps(150, 200);
  recording_.reset();
  EXPECT_GE(read_table("state.csv").rows.size(), 149u);
  for (const char* name : kCsvFiles) read_table(name);
  const Json manifest = read_manifest();
  EXPECT_EQ(manifest.at("complete"), false);
  EXPECT_EQ(manifest.at("outcome"), "recording");
  EXPECT_EQ(manifest.at("run_id"), "0123456789abcdef");
}

TEST_F(RecordingTest, AManifestMarkedIncompleteExistsFromTheStart) {
  EXPECT_EQ(read_manifest().at("complete"), false);
  for (const char* name : kCsvFiles) EXPECT_EQ(read_table(name).rows.size(), 0u) << name;
  EXPECT_EQ(read_table("state.csv").header.size(), 22u) << "headers are on disk at once";
}

// --- a full disk ---------------------------------------------------------------------------------

TEST_F(RecordingTest, AFullDiskEndsTheRecordingWhichIsMarkedIncomplete) {
  recording_->add(make_status(RunPhase::PHASE_RUNNING, 0));
  add_steps(0, kLastStep);
  recording_->add(make_status(RunPhase::PHASE_FINISHED, kLastStep));
  const std::string error = sls::test::find_error<std::system_error>([&] {
    const FileSizeLimit limit(20000);
    finish();
  });
  EXPECT_NE(error.find((folder_ / "state.csv").string()), std::string::npos) << error;
  EXPECT_NE(error.find("cannot write"), std::string::npos) << error;
  recording_.reset();
  EXPECT_EQ(read_manifest().at("complete"), false);
  EXPECT_EQ(read_manifest().at("outcome"), "recording");
  EXPECT_GT(read_table("state.csv").rows.size(), 10u);
  for (const char* name : kCsvFiles) read_table(name);
}

TEST_F(RecordingTest, ADiskThatIsFullAtTheVeryEndLeavesTheEarlierManifest) {
  fly_to_the_end();
  const std::string error = sls::test::find_error<std::system_error>([&] {
    const FileSizeLimit limit(100);
    finish();
  });
  EXPECT_NE(error.find((folder_ / "flight.txt").string()), std::string::npos) << error;
  EXPECT_NE(error.find("File too large"), std::string::npos) << error;
  EXPECT_EQ(read_manifest().at("complete"), false);
  EXPECT_FALSE(fs::exists(folder_ / "manifest.json.part"));
}

TEST_F(RecordingTest, AManifestThatDoesNotFitLeavesTheEarlierOneWhole) {
  const std::string earlier = read_bytes(folder_ / "manifest.json");
  Manifest manifest;
  manifest.parameters = make_parameters();
  manifest.complete = true;
  const std::string error = sls::test::find_error<std::system_error>([&] {
    const FileSizeLimit limit(100);
    write_manifest(folder_.path(), manifest);
  });
  EXPECT_NE(error.find((folder_ / "manifest.json").string()), std::string::npos) << error;
  EXPECT_NE(error.find("File too large"), std::string::npos) << error;
  EXPECT_EQ(read_bytes(folder_ / "manifest.json"), earlier);
  EXPECT_FALSE(fs::exists(folder_ / "manifest.json.part"));
}

// --- samples of other runs, and damaged texts ----------------------------------------------------

TEST_F(RecordingTest, TextsCutWithinALetterDoNotCostTheManifest) {
  add_steps(0, 10);
  std::string reason(254, 'x');
  reason += "\xc3\xa4";  // "ä": its second byte exceeds the 255 bytes of the contract
  recording_->add(make_status(RunPhase::PHASE_FAILED, 10, reason));
  EXPECT_FALSE(finish());
  const Json manifest = read_manifest();
  EXPECT_EQ(manifest.at("outcome"), "failed");
  EXPECT_EQ(manifest.at("reason").get<std::string>().substr(0, 254), reason.substr(0, 254));
}

TEST_F(RecordingTest, ASecondRecordingIntoTheSameFolderIsRefusedAndTheFirstKept) {
  fly_to_the_end();
  finish();
  EXPECT_THROW(Recording(folder_.path(), make_parameters()), std::system_error);
  EXPECT_EQ(read_manifest().at("complete"), true);
  EXPECT_EQ(read_table("state.csv").rows.size(), kLastStep + 1);
}

TEST(RecordingErrorTest, ParametersThatCannotBeUsedAreRefusedBeforeAnyFile) {
  const sls::test::TemporaryFolder folder;
  Parameters parameters = make_parameters();
  parameters.scenario_text("name: [");
  EXPECT_THROW(Recording(folder.path(), parameters), config::ConfigError);
  parameters = make_signal_parameters();
  parameters.signals()[0].name("step");
  EXPECT_THROW(Recording(folder.path(), parameters), config::ConfigError);
  parameters = make_parameters();
  parameters.vehicles().clear();
  EXPECT_THROW(Recording(folder.path(), parameters), config::ConfigError);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

}  // namespace
}  // namespace sls::record
