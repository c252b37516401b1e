// These tests change the recorded files themselves.
#include "recorder/verification.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <cmath>
#include <sstream>

#include "common/config/config_error.hpp"
#include "tests/recorder/flights.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/text.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;
using namespace test;
using sls::test::read_bytes;
using sls::test::write_bytes;

class VerificationTest : public testing::Test {
 protected:
  VerificationTest() {
    for (const auto& folder : {a_, b_}) {
      fs::create_directory(folder);
      record_flight(folder);
    }
  }

  /// Applies `to` to the field in `line` (the header is 1) and `column` (from 0) of a file of B.
  void change(const std::string& file, std::size_t line, std::size_t column,
              const std::function<std::string(const std::string&)>& to) {
    std::string bytes = read_bytes(b_ / file);
    std::size_t begin = 0;
    for (std::size_t i = 1; i < line; ++i) begin = bytes.find('\n', begin) + 1;
    for (std::size_t i = 0; i < column; ++i) begin = bytes.find(',', begin) + 1;
    const std::size_t end = bytes.find_first_of(",\n", begin);
    write_bytes(b_ / file, bytes.replace(begin, end - begin, to(bytes.substr(begin, end - begin))));
  }
  void remove_line(const std::string& file, std::size_t line) {
    std::string bytes = read_bytes(b_ / file);
    std::size_t begin = 0;
    for (std::size_t i = 1; i < line; ++i) begin = bytes.find('\n', begin) + 1;
    write_bytes(b_ / file, bytes.erase(begin, bytes.find('\n', begin) + 1 - begin));
  }

  std::string find_difference() {
    const auto difference = find_first_difference(open_recording(a_), open_recording(b_));
    return difference ? difference->text : "equal";
  }
  std::string find_problems(const fs::path& folder) {
    std::string text;
    for (const auto& problem : inspect(open_recording(folder)).problems) text += problem + '\n';
    return text;
  }

  const sls::test::TemporaryFolder folder_;
  const fs::path a_ = folder_ / "a", b_ = folder_ / "b";
};

/// The next double, as text.
std::string to_next(const std::string& text) {
  double value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  value = std::nextafter(value, 1e300);
  std::array<char, 32> digits;
  return {digits.data(), std::to_chars(digits.data(), digits.data() + 32, value).ptr};
}

TEST_F(VerificationTest, EqualRecordingsAreEqualAndAsTheirManifestsSay) {
  EXPECT_EQ(find_difference(), "equal");
  const Inspection of_a = inspect(open_recording(a_)), of_b = inspect(open_recording(b_));
  EXPECT_TRUE(of_a.problems.empty()) << of_a.problems.front();
  EXPECT_EQ(of_a.steps, kLastStep + 1);
  EXPECT_EQ(of_a.certificate, of_b.certificate);
  EXPECT_TRUE(list_notes(open_recording(a_), open_recording(b_)).empty());
}

TEST_F(VerificationTest, OneBitIsFoundAtItsStepAndColumn) {
  struct {
    const char* file;
    std::size_t column;
    const char* name;
  } const cases[] = {{"state.csv", 2, "sim_time_s"},     {"state.csv", 9, "load_x_m"},
                     {"state.csv", 21, "force_z_n"},     {"command.csv", 4, "force_y_n"},
                     {"reference.csv", 2, "sim_time_s"}, {"reference.csv", 19, "ref_sz_m_s4"}};
  for (const auto& planted : cases) {
    SCOPED_TRACE(planted.name);
    const std::string before = read_bytes(b_ / planted.file);
    std::string from, to;
    change(planted.file, 125, planted.column,
           [&](const std::string& text) { return to = to_next(from = text); });
    EXPECT_EQ(find_difference(), std::string(planted.file) + ", vehicle 0, step 123, " +
                                     planted.name + ": " + from + " in A, " + to + " in B");
    EXPECT_NE(find_problems(b_).find(planted.file), std::string::npos);
    EXPECT_NE(find_problems(b_).find("certificate"), std::string::npos);
    write_bytes(b_ / planted.file, before);
  }
  EXPECT_EQ(find_difference(), "equal");
}

TEST_F(VerificationTest, TheFirstDifferenceInStepOrderIsNamed) {
  change("state.csv", 200, 5, to_next);
  change("reference.csv", 102, 5, to_next);
  change("command.csv", 102, 7, [](auto&) { return "held"; });
  EXPECT_EQ(find_difference(), "command.csv, vehicle 0, step 100, fault: 'none' in A, 'held' in B");
}

TEST_F(VerificationTest, ClientNamesComputeTimesAndWaysOfWritingANumberAreNoDifference) {
  for (std::size_t line = 2; line <= kLastStep + 2; ++line) {
    change("command.csv", line, 2, [](auto&) { return "standby"; });
    change("command.csv", line, 6, [](auto&) { return "0"; });
  }
  change("state.csv", 2, 2, [](auto&) { return "0.000"; });
  EXPECT_EQ(find_difference(), "equal");
  EXPECT_NE(find_problems(b_).find("command.csv: SHA-256"), std::string::npos);
  EXPECT_EQ(find_problems(b_).find("certificate"), std::string::npos);
}

TEST_F(VerificationTest, SignedZerosAndNanAreDistinguished) {
  change("state.csv", 2, 19, [](auto&) { return "-0"; });
  EXPECT_EQ(
      find_difference(),
      "state.csv, vehicle 0, step 0, force_x_n: 0 in A, -0 in B (equal numbers of other bits)");
  change("state.csv", 2, 19, [](auto&) { return "nan"; });
  EXPECT_EQ(find_difference(), "state.csv, vehicle 0, step 0, force_x_n: 0 in A, nan in B");
}

TEST_F(VerificationTest, TheLargestDifferenceOfEachColumnIsListed) {
  const auto list = [&] {
    std::vector<std::string> lines;
    for (const auto& one : list_deviations(open_recording(a_), open_recording(b_)))
      lines.push_back(describe(one));
    return lines;
  };
  EXPECT_TRUE(list().empty());
  const auto add = [](double more) {
    return [more](const std::string& text) { return std::to_string(std::stod(text) + more); };
  };
  change("state.csv", 20, 9, [](auto&) { return "1000"; });
  const double before = std::stod(find_difference().substr(find_difference().find("_m: ") + 4));
  change("state.csv", 20, 9, [&](auto&) { return std::to_string(before + 0.25); });
  change("state.csv", 40, 9, add(-0.5));
  change("state.csv", 2, 19, [](auto&) { return "-0"; });
  change("command.csv", 102, 7, [](auto&) { return "held"; });
  remove_line("state.csv", 10);  // steps that one lacks are left out
  const auto lines = list();
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0], "state.csv, load_x_m: 0.5, vehicle 0, step 38");
  EXPECT_EQ(lines[1], "state.csv, force_x_n: other bits of equal numbers, vehicle 0, step 0");
  EXPECT_EQ(lines[2], "command.csv, fault: other values, vehicle 0, step 100");
}

TEST_F(VerificationTest, RowsThatOnlyOneHasAreNamed) {
  remove_line("command.csv", 52);
  EXPECT_EQ(find_difference(), "command.csv, vehicle 0, step 50: a row in A alone");
  EXPECT_NE(find_problems(b_).find("command.csv: 300 rows, manifest: 301"), std::string::npos);
  for (const char* file : {"state.csv", "command.csv", "reference.csv"})
    for (std::size_t line = 30; line > 20; --line) remove_line(file, line);
  EXPECT_EQ(find_difference(), "vehicle 0, step 19: in A alone");
}

TEST_F(VerificationTest, AShorterRecordingDiffersWhereItEnds) {
  fs::remove_all(b_);
  fs::create_directory(b_);
  {
    Recording recording(b_, make_parameters());
    add_steps(recording, 0, 200);
    recording.finish("interrupted by SIGINT", 0);
  }
  EXPECT_EQ(find_difference(), "vehicle 0, step 201: in A alone");
  EXPECT_EQ(find_problems(b_), "") << "it matches its manifest";
  const auto notes = list_notes(open_recording(a_), open_recording(b_));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_EQ(notes[0], "B: not complete: interrupted: interrupted by SIGINT");
}

TEST_F(VerificationTest, ScenarioPeriodModeAndMissingStepsAreNoted) {
  fs::remove_all(b_);
  fs::create_directory(b_);
  Parameters parameters = make_parameters();
  parameters.period_ns(2'000'000);
  parameters.mode(SyncMode::MODE_REALTIME);
  parameters.scenario_sha256(std::string(64, 'f'));
  Recording recording(b_, parameters);
  BatchFeeder feeder(recording);
  feeder.add_steps(0, 6);
  feeder.add_steps(8, kLastStep);
  finish_flight(recording);
  std::string text;
  for (const auto& note : list_notes(open_recording(a_), open_recording(b_))) text += note + '\n';
  for (const char* part :
       {"period in force, s: 0.004 in A, 0.002 in B", "mode: lockstep in A, realtime in B",
        "ffff in B", "B: 3 samples missing, first sls/state step 7 of vehicle 0"})
    EXPECT_NE(text.find(part), std::string::npos) << part << '\n' << text;
  EXPECT_EQ(find_difference(), "state.csv, vehicle 0, step 1, sim_time_s: 0.004 in A, 0.002 in B");
}

TEST_F(VerificationTest, FilesThatDifferFromTheManifestAreNamed) {
  write_bytes(b_ / "flight.txt", "forged");
  EXPECT_EQ(find_difference(), "equal");
  EXPECT_EQ(find_problems(b_).find((b_ / "flight.txt").string() + ": SHA-256"), 0u);
  fs::remove(b_ / "status.csv");
  EXPECT_NE(find_problems(b_).find((b_ / "status.csv").string() + ": expected a file, got none"),
            std::string::npos);
}

TEST_F(VerificationTest, AMalformedRowIsNamedWithItsLineUnlessADifferenceComesFirst) {
  change("state.csv", 90, 3, [](auto&) { return "1.2.3"; });
  const std::string place = (b_ / "state.csv").string() + ":90: quad_x_m: expected a number";
  EXPECT_NE(find_problems(b_).find(place), std::string::npos) << find_problems(b_);
  EXPECT_EQ(sls::test::find_error<DamagedError>([&] { find_difference(); }),
            place + ", got '1.2.3'");
  change("command.csv", 50, 3, to_next);
  EXPECT_EQ(find_difference().find("command.csv, vehicle 0, step 48"), 0u);
}

TEST_F(VerificationTest, RowsOutOfOrderAreDamage) {
  change("reference.csv", 12, 1, [](auto&) { return "8"; });
  EXPECT_NE(find_problems(b_).find("reference.csv:12: step: expected one after 9, got 8"),
            std::string::npos)
      << find_problems(b_);
}

// The order of rows of different vehicles may differ between recordings.
TEST_F(VerificationTest, AFleetIsComparedInStepOrderForAnyOrderOfRows) {
  constexpr std::uint32_t kIds[] = {7, 0, 3};
  const auto record = [&](const fs::path& folder, std::uint64_t steps_apart) {
    fs::remove_all(folder);
    fs::create_directory(folder);
    Parameters parameters = make_parameters();
    set_vehicles(parameters, {0, 3, 7});
    Recording recording(folder, parameters);
    BatchFeeder feeder(recording);
    for (std::uint64_t first = 0; first <= kLastStep; first += steps_apart)
      for (const std::uint32_t id : kIds)
        for (auto step = first; step < std::min(first + steps_apart, kLastStep + 1); ++step) {
          RecordEntry entry = make_entry(step, id);
          if (id == 3 && step % 2 == 1) entry.kind(AnswerKind::ANSWER_HELD);
          feeder.add({entry});
        }
    feeder.add({}, true);
    finish_flight(recording);
  };
  record(a_, 1);
  record(b_, 100);
  EXPECT_EQ(find_difference(), "equal");
  for (const auto& folder : {a_, b_}) EXPECT_EQ(find_problems(folder), "");
  EXPECT_EQ(inspect(open_recording(a_)).certificate, inspect(open_recording(b_)).certificate);
  EXPECT_EQ(inspect(open_recording(b_)).steps, kLastStep + 1);
  EXPECT_EQ(find_next_step(open_recording(b_)), kLastStep + 1);

  const auto find_line = [&](const std::string& file, const std::string& begin) {
    const std::string bytes = read_bytes(b_ / file);
    return 1 + std::count(bytes.begin(), bytes.begin() + bytes.find('\n' + begin) + 1, '\n');
  };
  change("state.csv", find_line("state.csv", "7,50,"), 5, to_next);
  EXPECT_EQ(find_difference().find("state.csv, vehicle 7, step 50, quad_z_m"), 0u);
  change("state.csv", find_line("state.csv", "0,20,"), 5, to_next);
  EXPECT_EQ(find_difference().find("state.csv, vehicle 0, step 20, quad_z_m"), 0u);
  remove_line("command.csv", find_line("command.csv", "3,10,"));
  EXPECT_EQ(find_difference(), "command.csv, vehicle 3, step 10: a row in A alone");
}

TEST_F(VerificationTest, SignalsAreComparedByTheirNames) {
  for (const auto& folder : {a_, b_}) {
    fs::remove_all(folder);
    fs::create_directory(folder);
    record_flight(folder, {}, make_signal_parameters());
    EXPECT_EQ(find_problems(folder), "");
  }
  EXPECT_EQ(find_difference(), "equal");
  change("state.csv", 102, 30, [](auto&) { return "-7.5"; });
  EXPECT_EQ(find_difference(), "state.csv, vehicle 0, step 100, wind: -7 in A, -7.5 in B");
  EXPECT_NE(find_problems(b_).find("certificate"), std::string::npos);
  change("state.csv", 52, 22, to_next);
  EXPECT_EQ(find_difference().find("state.csv, vehicle 0, step 50, att_w"), 0u);
  change("state.csv", 1, 29, [](auto&) { return "force_n"; });
  EXPECT_EQ(find_difference(), "state.csv: other columns in A than in B");
  for (const char* header : {"att_w", "att_w,att_x,att_y,rate_z_rad_s"}) {  // as signals
    std::string bytes = read_bytes(b_ / "state.csv");
    write_bytes(b_ / "state.csv",
                bytes.replace(0, bytes.find('\n'), make_header<StateRow>() + "," + header));
    EXPECT_NE(find_problems(b_).find("state.csv:2: expected"), std::string::npos);
  }
  fs::copy_file(a_ / "state.csv", b_ / "state.csv", fs::copy_options::overwrite_existing);
  change("state.csv", 32, 23, [](auto&) { return "fast"; });
  EXPECT_NE(find_problems(b_).find("state.csv:32: att_x: expected a number, got 'fast'"),
            std::string::npos);
}

TEST_F(VerificationTest, MeasurementsAreCheckedAgainstTheManifestAndNotCertified) {
  fs::remove_all(b_);
  fs::create_directory(b_);
  record_flight(b_, [](RecordEntry& entry) { entry.measured({entry.truth()}); });
  EXPECT_EQ(find_problems(b_), "");
  EXPECT_EQ(find_difference(), "equal");
  EXPECT_EQ(inspect(open_recording(a_)).certificate, inspect(open_recording(b_)).certificate);
  remove_line("measured.csv", 100);
  EXPECT_NE(find_problems(b_).find("measured.csv: 300 rows, manifest: 301"), std::string::npos);
}

// Three steps from a recorder of contract 1; the corpus of the fuzzer has four of its files.
TEST_F(VerificationTest, ARecordingOfAnEarlierVersionKeepsItsCertificate) {
  std::istringstream corpus(read_bytes(SLS_SOURCE_DIR "/tests/fuzz/corpus/recording/three_steps"));
  for (const char* name : {"manifest.json", "state.csv", "command.csv", "reference.csv"}) {
    std::string bytes;
    std::getline(corpus, bytes, '\x1e');
    write_bytes(b_ / name, bytes);
  }
  const OpenedRecording flight = open_recording(b_);
  const Inspection inspection = inspect(flight);
  EXPECT_EQ(inspection.steps, 3u);
  EXPECT_EQ(inspection.certificate, flight.manifest().certificate);
}

TEST_F(VerificationTest, AKilledRecordingIsReadAndReportedAsUnfinished) {
  fs::remove_all(b_);
  fs::create_directory(b_);
  record_until_killed(make_segment(b_), 0, 200);
  EXPECT_EQ(find_difference(), "vehicle 0, step 201: in A alone");
  EXPECT_NE(find_problems(b_).find("lists no files"), std::string::npos);
}

TEST_F(VerificationTest, AFolderThatIsNoRecordingIsRefused) {
  EXPECT_THROW(open_recording(folder_ / "none"), config::ConfigError);
  EXPECT_THROW(open_recording(folder_.path()), config::ConfigError);
  for (const char* text : {"", "{", "[]", "{\"complete\": 3}", "null"}) {
    write_bytes(b_ / "manifest.json", text);
    EXPECT_THROW(open_recording(b_), config::ConfigError) << text;
  }
}

// The manifest of a recording may come from an untrusted source.
TEST_F(VerificationTest, AManifestNamesNoFilesElsewhereAndNoThousandsOfVehicles) {
  const std::string manifest = read_bytes(b_ / "manifest.json");
  for (const char* name : {"/dev/zero", "../a/state.csv", "..", "", "folder/"}) {
    write_bytes(b_ / "manifest.json", sls::test::replace_once(manifest, "\"state.csv\"",
                                                              "\"" + std::string(name) + "\""));
    EXPECT_THROW(open_recording(b_), config::ConfigError) << name;
  }
  std::string ids = "0";
  for (int i = 0; i < 300; ++i) ids += ", 0";
  const auto begin = manifest.find('[', manifest.find("\"vehicle_ids\"")) + 1;
  write_bytes(b_ / "manifest.json",
              std::string(manifest).replace(begin, manifest.find(']', begin) - begin, ids));
  EXPECT_THROW(open_recording(b_), config::ConfigError);
}

// Found by the fuzzer: only a whole number that fits is converted to an integer.
TEST_F(VerificationTest, AManifestsNumbersAreWholeNumbersThatFit) {
  struct Case {
    std::string from, to, expected;
  };
  const std::string manifest = read_bytes(b_ / "manifest.json");
  for (const Case& change : {
           Case{"\"rows\": 301", "\"rows\": 3.77778e+70",
                "rows: expected a whole number from 0 to 18446744073709551615, got 3.77778e+70"},
           Case{"\"rows\": 301", "\"rows\": -1", "rows: expected a whole number from 0 to"},
           Case{"\"rows\": 301", "\"rows\": [1]", "got an array"},
           Case{"\"first_step\": 0", "\"first_step\": 0.5", "first_step: expected a whole number"},
           Case{"\"missing\": []",
                "\"missing\": [{\"vehicle_id\": 4294967296, \"topic\": \"\", \"from\": 0, \"to\": "
                "0}]",
                "vehicle_id: expected a whole number from 0 to 4294967295, got 4294967296"},
           Case{"\"stage_starts\": []",
                "\"stage_starts\": [{\"vehicle_id\": 0, \"stage\": \"1\", \"step\": 0}]",
                "stage: expected a whole number from 0 to 4294967295, got \"1\""},
       }) {
    const auto at = manifest.find(change.from);
    ASSERT_NE(at, std::string::npos) << change.from;
    write_bytes(b_ / "manifest.json",
                std::string(manifest).replace(at, change.from.size(), change.to));
    const auto error = sls::test::find_error<config::ConfigError>([&] { open_recording(b_); });
    EXPECT_NE(error.find("manifest.json: "), std::string::npos) << error;
    EXPECT_NE(error.find(change.expected), std::string::npos) << error;
  }
}

TEST_F(VerificationTest, APipeOrADeviceInThePlaceOfAFileIsAProblem) {
  for (const std::string file : {"status.csv", "state.csv", "command.csv", "reference.csv"}) {
    fs::remove(b_ / file);
    ASSERT_EQ(file == "state.csv" ? ::symlink("/dev/zero", (b_ / file).c_str())
                                  : ::mkfifo((b_ / file).c_str(), 0600),
              0);
    EXPECT_NE(find_problems(b_).find(file + ": expected a file, got a pipe, socket or device"),
              std::string::npos)
        << file;
  }
  write_bytes(a_ / "flight.txt", "");
  fs::resize_file(a_ / "flight.txt", std::uintmax_t{1} << 40);  // reading it would take minutes
  EXPECT_NE(find_problems(a_).find("flight.txt: expected data, got zeros"), std::string::npos);
  fs::rename(b_ / "status.csv", b_ / "manifest.json");
  const auto find = [&] {
    return sls::test::find_error<config::ConfigError>([&] { open_recording(b_); });
  };
  EXPECT_NE(find().find("expected a manifest, got a pipe, socket or device"), std::string::npos);
  fs::remove(b_ / "manifest.json");
  write_bytes(b_ / "manifest.json", std::string(2'000'001, '['));
  EXPECT_NE(find().find("expected at most 2000000 bytes, got 2000001"), std::string::npos);
}

}  // namespace
}  // namespace sls::record
