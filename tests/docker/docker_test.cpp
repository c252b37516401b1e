/// Real flights by the launcher with the image and the compose files, compared with flights of the
/// programs outside containers.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <sstream>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const std::string kLauncher = std::string(SLS_SOURCE_DIR) + "/sls";
constexpr auto kImageTime = 1500s;  // the first test builds it
constexpr auto kFlightTime = 120s;

/// Ends a shell line: what follows are the project's name and the words of Compose.
const std::string kCompose =
    "; if docker compose version >/dev/null 2>&1; then set -- docker compose; else set -- "
    "docker-compose; fi; \"$@\" --project-name ";

Outcome run_shell(const std::string& command) { return run({"sh", "-c", command}, kFlightTime); }

/// The reason why this machine cannot fly in containers; empty if it can.
std::optional<std::string> find_obstacle() {
  if (run_shell("timeout 1 docker version").code != 0) return "no Docker engine";
  if (run_shell("docker compose version || docker-compose version").code != 0)
    return "no docker compose";
  return std::nullopt;
}

uid_t find_owner(const fs::path& path) {
  struct stat status = {};
  EXPECT_EQ(::lstat(path.c_str(), &status), 0) << path;
  return status.st_uid;
}

void expect_owner(const fs::path& recording, uid_t owner) {
  EXPECT_EQ(find_owner(recording), owner);
  for (const auto& entry : fs::directory_iterator(recording))
    EXPECT_EQ(find_owner(entry.path()), owner) << entry.path();
}

void expect_same_data(const fs::path& recording, const fs::path& expected) {
  expect_exit({program("sls_verify"), recording, expected});
}

class DockerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const auto obstacle = find_obstacle()) GTEST_SKIP() << "skipped: " << *obstacle;
    const Outcome image = run({kLauncher, "docker-demo", "--build"}, kImageTime);
    ASSERT_EQ(image.code, 0) << image.output;
  }

  // A demo removes everything itself. This removes the remains of failed tests.
  void TearDown() override {
    for (const std::string& project : projects_) {
      const std::string filter = " --quiet --filter label=com.docker.compose.project=" + project;
      run_shell("docker ps --all" + filter + " | xargs --no-run-if-empty docker rm --force");
      run_shell("docker network ls" + filter + " | xargs --no-run-if-empty docker network rm");
    }
  }

  std::vector<std::string> make_demo(const std::string& name, const std::string& what) const {
    return {kLauncher, "docker-demo", name, "--scenario", what, "--out", recording(name)};
  }
  fs::path recording(const std::string& name) const { return folder / ("of_" + name); }

  /// Flies with the launcher. Expects complete recordings in these folders of `recording`, their
  /// summaries, and no container, network or volume left behind.
  std::string expect_demo(const std::string& name, const std::string& what,
                          const std::vector<std::string>& folders = {""}) {
    Process demo(make_demo(name, what));
    const std::string project = note_project("sls-demo-", demo.id());
    EXPECT_EQ(demo.wait(kFlightTime), 0) << demo.output();
    for (const std::string& part : folders) {
      const fs::path made = part.empty() ? recording(name) : recording(name) / part;
      EXPECT_NE(demo.output().find("Files in " + made.string()), std::string::npos)
          << demo.output();
      EXPECT_TRUE(read_manifest(made).at("complete").get<bool>());
      expect_owner(made, geteuid());
    }
    expect_nothing_left(project);
    return demo.output();
  }

  std::string note_project(const std::string& prefix, pid_t id) {
    projects_.push_back(prefix + std::to_string(id));
    return projects_.back();
  }

  static void expect_nothing_left(const std::string& project) {
    const std::string filter = " --quiet --filter label=com.docker.compose.project=" + project;
    EXPECT_EQ(run_shell("docker ps --all" + filter).output, "");
    EXPECT_EQ(run_shell("docker network ls" + filter).output, "");
    EXPECT_EQ(run_shell("docker volume ls" + filter).output, "");
  }

  /// A long figure eight in real time: the test examines the containers during the flight.
  std::string make_slow_scenario() const {
    std::string text = read_file(scenario("figure_eight"));
    text = replace_once(text, "mode: lockstep", "mode: realtime");
    text = replace_once(text, "for_s: 32", "for_s: 3200");
    write_bytes(folder / "slow.yaml", text);
    return folder / "slow.yaml";
  }

  /// A copy of examples/ci with its law, as a user has it.
  fs::path make_ci_example() const {
    const fs::path ci = folder / "ci";
    fs::copy(std::string(SLS_SOURCE_DIR) + "/examples/ci", ci);
    const Outcome made =
        run_shell("cd " + ci.string() + " && mkdir build include && ln -s " + SLS_SOURCE_DIR +
                  "/control_client/laws/shared_library include/sls && gcc -O2 "
                  "-fPIC -shared -I include -o build/my_law.so my_law.c");
    EXPECT_EQ(made.code, 0) << made.output;
    return ci;
  }

  static std::string user() { return std::to_string(geteuid()) + ":" + std::to_string(getegid()); }

  TemporaryFolder folder;

 private:
  std::vector<std::string> projects_;
};

TEST_F(DockerTest, RecordsTheSameInContainersAsOnTheMachine) {
  Flight native(scenario("short"));
  native.expect_success();
  for (const std::string name : {"plain", "discovery", "secure"}) {
    SCOPED_TRACE(name);
    expect_demo(name, "short");
    expect_same_data(recording(name), native.recording());
  }
  const char* image = std::getenv("SLS_IMAGE");
  EXPECT_EQ(expect_exit({"docker", "run", "--rm", image ? image : "sls", "id", "-un"}), "sls\n");
}

TEST_F(DockerTest, AStandbyTakesOverFromAKilledControllerAndNothingChanges) {
  Flight native(scenario("figure_eight"));
  native.expect_success();
  const std::string output = expect_demo("standby", "figure_eight");
  EXPECT_TRUE(holds(output, "killed the first controller")) << output;
  expect_same_data(recording("standby"), native.recording());
  EXPECT_TRUE(holds(output, "controller 'standby' takes over from 'primary'")) << output;
}

/// Flies the vehicles `first` to `last` of a scenario outside containers and records into `out`.
void fly_natively(const std::string& scenario_file, int first, int last, const fs::path& out) {
  const Programs native;
  const Words flags = {"--scenario", scenario_file, "--vehicles",
                       std::to_string(first) + "-" + std::to_string(last)};
  const auto recorder =
                 native.start("recorder", {"--out", out, "--vehicle", std::to_string(first)}),
             server = native.start("sim_server", flags),
             client = native.start("control_client", flags);
  expect_success({server.get(), client.get(), recorder.get()});
}

TEST_F(DockerTest, TwoServersOnOneNetworkShareAFleet) {
  const std::string fleet = folder / "fleet.yaml";
  write_bytes(fleet, read_file(scenario("short")) + "\nvehicles: 8\n");
  expect_demo("fleet", fleet, {"0-3", "4-7"});
  for (const int first : {0, 4}) {
    const std::string vehicles = std::to_string(first) + "-" + std::to_string(first + 3);
    SCOPED_TRACE(vehicles);
    fly_natively(fleet, first, first + 3, folder / vehicles);
    expect_same_data(recording("fleet") / vehicles, folder / vehicles);
    const Table states(recording("fleet") / vehicles / "state.csv");
    EXPECT_EQ(states.number(0, "vehicle_id"), first);
  }
}

TEST_F(DockerTest, AnInterruptedDemoLeavesAReadableRecordingAndNothingElse) {
  Process demo(make_demo("plain", make_slow_scenario()));
  const std::string project = note_project("sls-demo-", demo.id());
  ASSERT_TRUE(wait_until(
      [&] {
        const auto rows = read_file(recording("plain") / "state.csv");
        return std::count(rows.begin(), rows.end(), '\n') > 100 || !demo.is_running();
      },
      kFlightTime))
      << demo.output();
  demo.send(SIGINT);
  EXPECT_EQ(demo.wait(kFlightTime), 130) << demo.output();
  EXPECT_FALSE(read_manifest(recording("plain")).at("complete").get<bool>());
  expect_owner(recording("plain"), geteuid());
  expect_nothing_left(project);
}

TEST_F(DockerTest, ADemoEndsWithTheExitCodeOfTheProgramThatFailed) {
  write_bytes(folder / "bad.yaml",
              replace_once(read_file(scenario("short")), "period_s: 0.004", "period_s: -1"));
  Process demo(make_demo("plain", folder / "bad.yaml"));
  const std::string project = note_project("sls-demo-", demo.id());
  EXPECT_EQ(demo.wait(kFlightTime), 2) << demo.output();
  EXPECT_TRUE(holds(demo.output(), "sync.period_s: expected")) << demo.output();
  expect_nothing_left(project);
}

TEST_F(DockerTest, TheComposeFileOfTheCiExampleFliesWhatItsCheckExpects) {
  const fs::path ci = make_ci_example();
  const std::string project = note_project("sls-test-ci-", getpid());
  const std::string lines = "set -e; cd " + ci.string() +
                            "; mkdir recording; export MY_IMAGE=sls-test-ci SLS_USER=" + user() +
                            kCompose + project;
  const Outcome up = run_shell(lines + " up --build");
  EXPECT_EQ(up.code, 0) << up.output;
  expect_exit(
      {kLauncher, "--no-install", "check", ci / "check.yaml", "--recording", ci / "recording"});
  EXPECT_EQ(run_shell("cd " + ci.string() + kCompose + project + " down").code, 0);
  run_shell("docker image rm sls-test-ci");
  expect_nothing_left(project);
}

/// The command is that of docs/testing-your-controller.md.
TEST_F(DockerTest, ACheckFliesAControllerInAContainerAndRefusesAMissingImage) {
  const fs::path ci = make_ci_example();
  const auto check = [&](const std::string& image) {
    write_bytes(ci / "check.yaml",
                "scenario: scenario.yaml\nplacements: [shm, udp]\n"
                "participants:\n  controller:\n    command:\n      [docker, run, --rm, --init, "
                "--network, host, --ipc, host, --user, '" +
                    user() + "', -v, '" + ci.string() + ":/flight:ro', -v, '{qos}:{qos}:ro', " +
                    image +
                    ", control_client, --scenario,\n       /flight/scenario.yaml, --qos, '{qos}', "
                    "--domain, '{domain}']\n"
                    "expect:\n  - { measure: load_error_end_m, stage: 0, max: 0.01 }\n");
    return run({kLauncher, "--no-install", "check", ci / "check.yaml"});
  };
  const char* image = std::getenv("SLS_IMAGE");
  const Outcome held = check(image ? image : "sls");
  EXPECT_EQ(held.code, 0) << held.output;
  EXPECT_TRUE(holds(held.output, "2 flights: 2 held; the flights of each check have equal bytes"))
      << held.output;
  const Outcome missing = check("sls-no-such-image");
  EXPECT_EQ(missing.code, 2) << missing.output;
  EXPECT_TRUE(holds(missing.output,
                    "controller: ended with 125 at step 0, before the flight was over: "
                    "Unable to find image"))
      << missing.output;
  EXPECT_EQ(run_shell("docker ps --all --quiet --filter volume=" + ci.string()).output, "");
}

TEST_F(DockerTest, ServicesAreHealthyWhileTheyFlyAndRunAsTheUserTheyWereTold) {
  if (geteuid() != 0) GTEST_SKIP() << "skipped: only root can give a folder to another user";
  constexpr uid_t kUser = 12345;
  const fs::path out = folder / "out";
  fs::create_directory(out);
  ASSERT_EQ(::chown(out.c_str(), kUser, kUser), 0);
  const std::string project = note_project("sls-test-", getpid());
  const std::string compose =
      "cd " + std::string(SLS_SOURCE_DIR) +
      "/docker && export SLS_USER=12345:12345 SLS_RECORDING=" + out.string() +
      " SLS_SCENARIO=" + make_slow_scenario() + kCompose + project + " --file compose.yaml ";
  const auto find_container = [&](const std::string& service) {
    std::istringstream ids(
        run_shell("docker ps --all --quiet --filter label=com.docker.compose.project=" + project +
                  " --filter label=com.docker.compose.service=" + service)
            .output);
    std::string id;
    ids >> id;
    return id;
  };
  Process up({"sh", "-c", compose + "up --detach"});
  ASSERT_EQ(up.wait(kFlightTime), 0) << up.output();

  for (const std::string service : {"server", "controller", "recorder"}) {
    SCOPED_TRACE(service);
    const std::string inside = "docker exec " + find_container(service) + " ";
    Outcome health;
    EXPECT_TRUE(
        wait_until([&] { return (health = run_shell(inside + "sls-health")).code == 0; }, 60s))
        << health.output;
    EXPECT_EQ(run_shell(inside + "id -u").output, "12345\n");
    EXPECT_EQ(run_shell("docker inspect --format '{{.Config.Healthcheck.Test}}' " +
                        find_container(service))
                  .output,
              "[CMD sls-health]\n");
  }
  // The health check must fail for a program that hangs.
  const std::string server = find_container("server");
  EXPECT_EQ(run_shell("docker kill --signal STOP " + server).code, 0);
  const Outcome health = run_shell("docker exec " + server + " sls-health");
  EXPECT_EQ(health.code, 1) << health.output;
  EXPECT_EQ(run_shell("docker kill --signal CONT " + server).code, 0);

  const Outcome stop = run_shell(compose + "stop");
  EXPECT_EQ(stop.code, 0) << stop.output;
  expect_owner(out, kUser);
  EXPECT_FALSE(read_manifest(out).at("complete").get<bool>());
  const Outcome down = run_shell(compose + "down --volumes");
  EXPECT_EQ(down.code, 0) << down.output;
  expect_nothing_left(project);
}

}  // namespace
}  // namespace sls::test
