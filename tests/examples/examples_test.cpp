// Builds the examples as a user does, against an installation and outside the tree, and flies them.
#include <gtest/gtest.h>

#include <cstdio>

#include "common/text/sha256.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

/// An installation and copies of the examples, built against it.
class Installation {
 public:
  Installation() {
    expect_exit({SLS_CMAKE, "--install", SLS_BUILD_DIR, "--prefix", folder_ / "installed"});
    std::vector<std::unique_ptr<Process>> builds;
    for (const char* name : {"my_autopilot", "my_controller", "my_plant", "my_law", "my_logger"}) {
      fs::copy(std::string(SLS_SOURCE_DIR) + "/examples/" + name, example(name));
      const std::string build = example(name) / "build";
      builds.push_back(std::make_unique<Process>(std::vector<std::string>{
          "sh", "-c",
          std::string(SLS_CMAKE) + " -S " + example(name).string() + " -B " + build +
              " -DCMAKE_PREFIX_PATH=" + (folder_ / "installed").string() +
              " -DCMAKE_C_FLAGS=-Werror -DCMAKE_CXX_FLAGS=-Werror && " + SLS_CMAKE + " --build " +
              build}));
    }
    for (const auto& build : builds) EXPECT_EQ(build->wait(), 0) << build->output();
  }

  fs::path example(const std::string& name) const { return folder_ / name; }
  fs::path scenario(const std::string& name) const { return example(name) / (name + ".yaml"); }
  std::string program(const std::string& name) const { return folder_ / ("installed/bin/" + name); }

  /// Flies `scenario` with the three programs. @returns the recording.
  fs::path fly(const std::string& scenario, const OwnDomain& domain) {
    const fs::path recording = folder_ / "recording" / std::to_string(++flights_);
    const auto start = [&](const char* name, const char* option, const std::string& file) {
      return std::make_unique<Process>(
          std::vector<std::string>{program(name), "--domain", domain.text(), option, file});
    };
    const auto recorder = start("recorder", "--out", recording);
    const auto server = start("sim_server", "--scenario", scenario);
    const auto client = start("control_client", "--scenario", scenario);
    expect_success({server.get(), client.get(), recorder.get()});
    return recording;
  }

 private:
  TemporaryFolder folder_;
  int flights_ = 0;
};

/// Flies the example's scenario with the three programs and in one process; expects the same
/// flight. @returns the recording of the one process.
fs::path expect_same_flight(Installation& installation, const std::string& name) {
  SCOPED_TRACE(name);
  const std::string scenario = installation.scenario(name);
  const OwnDomain domain;
  const fs::path three = installation.fly(scenario, domain), one = three.string() + "-in-process";
  expect_exit({installation.program("closed_loop"), "--scenario", scenario, "--out", one});
  EXPECT_TRUE(read_manifest(three).at("complete").get<bool>());
  EXPECT_TRUE(read_manifest(one).at("complete").get<bool>());
  EXPECT_EQ(read_manifest(three).at("certificate"), read_manifest(one).at("certificate"));
  EXPECT_GT(Table(one / "state.csv").rows(), 500u);
  return one;
}

/// Expects that the scenario of `name` with `parameter` misspelt is refused with its line.
void expect_refused(const Installation& installation, const std::string& name,
                    const std::string& parameter, const std::string& section, int line,
                    const std::string& known) {
  const std::string file = installation.example(name) / "misspelt.yaml";
  write_bytes(file, replace_once(read_bytes(installation.scenario(name)), "{ " + parameter + ":",
                                 "{ x" + parameter + ":"));
  EXPECT_EQ(expect_exit({installation.program("closed_loop"), "--scenario", file}, 2),
            "closed_loop: error: " + file + ":" + std::to_string(line) + ": " + section +
                ".parameters: " + installation.example(name).string() + "/build/" + name +
                ".so: expected " + known + ", got x" + parameter + "\n");
}

TEST(ExamplesTest, AreInstalledBuiltAndFlownAsByAUser) {
  Installation installation;
  ASSERT_FALSE(HasFailure());

  expect_same_flight(installation, "my_controller");
  expect_refused(installation, "my_controller", "position", "controller", 7,
                 "position, velocity, integral, rod_angle, rod_rate or filter_s");
  expect_exit({"ctest", "--test-dir", installation.example("my_controller") / "build"});
  expect_same_flight(installation, "my_plant");
  expect_refused(installation, "my_plant", "stiffness_n_per_m", "plant", 6,
                 "stiffness_n_per_m or damping_n_s_m");
  const fs::path turned = expect_same_flight(installation, "my_autopilot");
  EXPECT_EQ(read_manifest(turned).at("libraries").at("plant").get<std::string>(),
            text::calc_file_sha256(installation.example("my_autopilot") / "build/my_autopilot.so"));
  expect_refused(installation, "my_autopilot", "attitude_1_s2", "autopilot", 18,
                 "attitude_1_s2 or rate_1_s");
  // 6 s after the reference returned to (0, 0, −1) m.
  const Table flown(turned / "state.csv");
  const Eigen::Vector3d end = flown.position(flown.rows() - 1, "load");
  EXPECT_LT((end - Eigen::Vector3d(0.0, 0.0, -1.0)).norm(), 1e-3);

  const std::string said = expect_exit(
      {installation.example("my_law") / "build/my_law", installation.scenario("my_law")});
  int steps = 0;
  double rms = 0.0, error_at_end = 1.0;
  ASSERT_EQ(std::sscanf(said.c_str(), "%d steps, load position error: rms %lf m, at the end %lf m",
                        &steps, &rms, &error_at_end),
            3)
      << said;
  EXPECT_EQ(steps, 7501);         // 30 s at 4 ms
  EXPECT_GT(rms, 0.5);            // set-points metres apart, reached within seconds
  EXPECT_LT(error_at_end, 1e-3);  // poles of at most -0.7 1/s, 15 s

  const OwnDomain domain;
  Process logger({installation.example("my_logger") / "build/my_logger", domain.text()});
  installation.fly(scenario("short"), domain);
  EXPECT_EQ(logger.wait(), 0) << logger.output();
  EXPECT_TRUE(holds(logger.output(), "step     0  load at   0.000   0.000  -0.500 m\n"));
  EXPECT_TRUE(holds(logger.output(), "\n501 states\n")) << logger.output();
}

}  // namespace
}  // namespace sls::test
