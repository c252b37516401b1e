/// A flight of the three real programs in a DDS domain of its own, and its recording.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/own_domain.hpp"
#include "tests/system/process.hpp"

namespace sls::test {

struct FlightOptions {
  std::string qos_file;  ///< default: the programs' default
  Words server;          ///< further flags
  Words client;
  /// Put before the command line of a program, such as `Network::on("server")` or {"env", "A=B"}.
  std::map<std::string, Words> before = {};
};

/// The command line of one of the programs in `domain`.
Words make_command(const std::string& name, int domain, const Words& flags,
                   const std::string& qos_file = {});

/// Command prefix of a program that loses this share of its datagrams, also received ones.
Words lossy(int percent);

/// Programs that are started one by one in a DDS domain of their own, and their recording.
class Programs {
 public:
  explicit Programs(const FlightOptions& options = {}) : options_(options) {}

  /// Its command line follows the options' `before` of this program, and `before`.
  std::unique_ptr<Process> start(const std::string& name, const Words& flags,
                                 const Words& before = {}, const std::string& qos_file = {}) const;

  std::filesystem::path recording() const { return folder / "recording"; }

  TemporaryFolder folder;
  OwnDomain domain;

 private:
  const FlightOptions options_;
};

/// A test of such programs.
class ProgramsTest : public testing::Test, protected Programs {};

/// Further flags of a server: 32,000 steps of the figure eight instead of 8,000. An idle machine
/// flies 20,000 steps/s in lockstep: a shorter flight may be over before a test has killed, stopped
/// or cut off a program.
inline const Words kManySteps = {"--period-s", "0.001"};

/// Writes a figure eight of 16,000 steps, with `changes`, whose rows are on the disk within 20 ms:
/// a test sees early that it flies, and has half of its time left on a machine that flies 40,000
/// steps/s.
std::string make_long_scenario(const TemporaryFolder& folder,
                               std::vector<std::pair<std::string, std::string>> changes = {});

/// Starts recorder, server and client on `scenario_file`.
class Flight : public Programs {
 public:
  explicit Flight(const std::string& scenario_file, const FlightOptions& options = {});

  /// Waits for all three; fails the test if one does not end.
  void wait();
  /// Waits for all three; expects exit code 0 and a complete recording.
  void expect_success();
  /// Waits until at least `steps` rows of state.csv are on the disk.
  bool wait_for_steps(std::size_t steps) const;

  /// Output of all three, for messages.
  std::string outputs() const;

  std::unique_ptr<Process> recorder, server, client;
};

/// A QoS file in `folder`: the shipped `base` with a history of `batches` samples of sls/record.
std::string make_qos_with_history(const TemporaryFolder& folder, const std::string& base,
                                  const std::string& batches);

/// A CSV file by columns; numbers and text.
class Table {
 public:
  explicit Table(const std::filesystem::path& file);
  std::size_t rows() const { return rows_.size(); }
  const std::vector<std::string>& names() const { return names_; }
  double number(std::size_t row, const std::string& column) const;
  const std::string& text(std::size_t row, const std::string& column) const;
  /// The columns `prefix`_x_m, `prefix`_y_m, `prefix`_z_m.
  Eigen::Vector3d position(std::size_t row, const std::string& prefix) const;
  /// True when every row has a value for every column.
  bool is_well_formed() const;

 private:
  std::size_t find(const std::string& column) const;
  std::vector<std::string> names_;
  std::map<std::string, std::size_t> columns_;
  std::vector<std::vector<std::string>> rows_;
};

nlohmann::json read_manifest(const std::filesystem::path& recording);
std::string read_certificate(const std::filesystem::path& recording);

/// Flies the scenario in one process, without DDS. Returns the folder `recording`.
std::filesystem::path fly_in_process(const std::string& scenario_file,
                                     const std::filesystem::path& recording,
                                     const std::vector<std::string>& flags = {});

/// Expects that sls_verify finds `recording` equal to one of the same flight in one process.
void expect_undisturbed(const std::filesystem::path& recording, const std::string& scenario_file,
                        const std::vector<std::string>& flags = {});

/// Load minus reference position over the steps [first, last] of a recording.
struct TrackingError {
  Eigen::Vector3d rms = Eigen::Vector3d::Zero();
  Eigen::Vector3d max = Eigen::Vector3d::Zero();
};
TrackingError calc_tracking_error(const std::filesystem::path& recording, std::size_t first,
                                  std::size_t last);

}  // namespace sls::test
