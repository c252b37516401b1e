// Compares the certificate with a second implementation from the README and the CSV files alone.
#include "recorder/certificate.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "tests/recorder/csv_table.hpp"
#include "tests/recorder/flights.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;
using namespace test;
using sls::test::read_bytes;

/// `size` bytes of `value`, the least significant first.
std::string little_endian(std::uint64_t value, int size) {
  std::string bytes;
  for (int i = 0; i < size; ++i, value /= 256) bytes.push_back(static_cast<char>(value % 256));
  return bytes;
}
std::string length_and(const std::string& text) { return little_endian(text.size(), 4) + text; }
std::string number(const std::string& text) {
  const double value = std::strtod(text.c_str(), nullptr);
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  return little_endian(bits, 8);
}

std::string from_hex(const std::string& hex) {
  std::string bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    bytes.push_back(static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return bytes;
}

/// The bytes of a row according to the README. Kinds: n a number, i a stage, t a text, - nothing.
std::string to_certified_bytes(const std::string& topic, const std::string& kinds,
                               const std::vector<std::string>& row) {
  std::string bytes = length_and(topic) + little_endian(std::stoul(row.at(0)), 4) +
                      little_endian(std::stoull(row.at(1)), 8);
  for (std::size_t i = 2; i < row.size(); ++i) {
    if (kinds.at(i - 2) == 'n') bytes += number(row[i]);
    if (kinds.at(i - 2) == 'i') bytes += little_endian(std::stoul(row[i]), 4);
    if (kinds.at(i - 2) == 't') bytes += length_and(row[i]);
  }
  return bytes;
}

std::string calc_certificate(const fs::path& folder) {
  // Bytes by vehicle, step and file: state, command, reference.
  std::map<unsigned long, std::map<unsigned long long, std::map<int, std::string>>> vehicles;
  const auto add_file = [&](const char* file, int place, const char* topic,
                            const std::string& kinds) {
    for (const auto& row : parse_csv(read_bytes(folder / file)).rows)
      vehicles[std::stoul(row.at(0))][std::stoull(row.at(1))][place] =
          to_certified_bytes(topic, kinds, row);
  };
  const std::size_t columns = parse_csv(read_bytes(folder / "state.csv")).header.size();
  add_file("state.csv", 0, "sls/state", std::string(columns - 2, 'n'));
  add_file("command.csv", 1, "sls/command", "-nnn-t");
  add_file("reference.csv", 2, "sls/reference", "nit" + std::string(15, 'n'));
  std::string all;
  for (const auto& [id, steps] : vehicles) {
    std::string bytes;
    for (const auto& step : steps)
      for (const auto& row : step.second) bytes += row.second;
    all += little_endian(id, 4) + from_hex(text::calc_sha256(bytes));
  }
  return text::calc_sha256(all);
}

std::string read_certificate(const fs::path& folder) {
  return nlohmann::json::parse(read_bytes(folder / "manifest.json")).at("certificate");
}

/// The certificate of the synthetic run with something changed.
std::string certify(const std::function<void(RecordEntry&)>& change,
                    const Parameters& parameters = make_parameters()) {
  const sls::test::TemporaryFolder folder;
  record_flight(folder.path(), change, parameters);
  EXPECT_EQ(read_certificate(folder.path()), calc_certificate(folder.path()));
  return read_certificate(folder.path());
}

TEST(CertificateTest, CoversEveryVehicle) {
  const sls::test::TemporaryFolder folder;
  Parameters parameters = make_parameters();
  set_vehicles(parameters, {0, 7});
  Recording recording(folder.path(), parameters);
  BatchFeeder feeder(recording);
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    RecordEntry other = make_entry(step, 7);
    other.truth().p_WQ_m()[0] += 7;
    feeder.add({make_entry(step), other}, step == kLastStep);
  }
  EXPECT_TRUE(finish_flight(recording));
  EXPECT_EQ(read_certificate(folder.path()), calc_certificate(folder.path()));
}

TEST(CertificateTest, LeavesOutFieldsThatDifferBetweenEqualFlights) {
  const std::string expected = certify({});
  EXPECT_EQ(expected.size(), 64u);
  EXPECT_EQ(certify([](RecordEntry& entry) {
              entry.measured({PlantState()});  // only the true state is certified
              entry.client_name("other");
              entry.answered_step(3);
              entry.answer().compute_time_ns(7);
              entry.truth().q_WB({0, 1, 0, 0});  // the parameters announce no attitude
              entry.truth().signals({1, 2, 3});
            }),
            expected);
  const sls::test::TemporaryFolder folder;
  Parameters parameters = make_parameters();
  parameters.run_id(5);
  Recording recording(folder.path(), parameters);
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    RecordBatch batch = make_batch(step, {make_entry(step)}, step == kLastStep);
    batch.run_id(5);
    recording.add(batch);
  }
  SimStatus end = make_status(RunPhase::PHASE_FINISHED, kLastStep);
  end.run_id(5);
  end.counters().duplicate(99);
  recording.add(end);
  EXPECT_TRUE(recording.finish("", 0));
  EXPECT_EQ(read_certificate(folder.path()), expected);
}

using Changes = std::vector<std::function<void(RecordEntry&)>>;

void expect_others(const Changes& changes, const Parameters& parameters) {
  const std::string expected = certify({}, parameters);
  for (std::size_t i = 0; i < changes.size(); ++i)
    EXPECT_NE(certify(
                  [&](RecordEntry& entry) {
                    if (entry.step() == 123) changes[i](entry);
                  },
                  parameters),
              expected)
        << i;
}

TEST(CertificateTest, ChangesWithEveryFieldThatIsPartOfTheFlight) {
  expect_others({[](RecordEntry& entry) { entry.truth().p_WL_m()[2] += 1e-15; },
                 [](RecordEntry& entry) { entry.truth().beta_dot_rad_s(-0.0); },
                 [](RecordEntry& entry) { entry.f_Q_W_n()[1] = 17; },
                 [](RecordEntry& entry) { entry.answer().f_Q_W_n()[1] = 17; },
                 [](RecordEntry& entry) { entry.answer().fault(FaultCode::FAULT_STAGE_TIMEOUT); },
                 [](RecordEntry& entry) { entry.kind(AnswerKind::ANSWER_HELD); },
                 [](RecordEntry& entry) { entry.answer().reference().stage_index(2); },
                 [](RecordEntry& entry) { entry.answer().reference().stage_name("a, \"b\"\n"); },
                 [](RecordEntry& entry) { entry.answer().reference().snap_m_s4()[2] += 1e-12; }},
                make_parameters());
}

TEST(CertificateTest, CoversAttitudeRatesAndSignalsWhereTheRunHasThem) {
  EXPECT_NE(certify({}, make_signal_parameters()), certify({}));
  expect_others({[](RecordEntry& entry) { entry.truth().q_WB()[3] = 0.0; },
                 [](RecordEntry& entry) { entry.truth().w_WB_B_rad_s()[2] += 1e-14; },
                 [](RecordEntry& entry) { entry.truth().signals()[1] = -8; },
                 [](RecordEntry& entry) { entry.truth().signals().clear(); }},
                make_signal_parameters());
}

TEST(CertificateTest, NanReadsBackToTheSameCertificate) {
  certify([](RecordEntry& entry) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    entry.truth().p_WQ_m({nan, -nan, std::numeric_limits<double>::infinity()});
    entry.answer().reference().jerk_m_s3({-0.0, 0.0, -std::numeric_limits<double>::infinity()});
  });
}

}  // namespace
}  // namespace sls::record
