/// The real sls_view with flights of the real programs.
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "tests/system/flight.hpp"
#include "tests/tools/view/live/fake_server.hpp"
#include "tests/tools/view/live/page_client.hpp"

namespace sls::test {
namespace {

std::unique_ptr<Process> start_viewer(const OwnDomain& domain, const Words& flags = {}) {
  return std::make_unique<Process>(
      make_command("sls_view", domain.number(), flags + Words{"--port", "0"}));
}

const std::vector<std::string> kRealtime = {"--mode", "realtime"};

/// Row of `table` by step.
std::map<std::size_t, std::size_t> index_steps(const Table& table) {
  std::map<std::size_t, std::size_t> row_of;
  for (std::size_t i = 0; i < table.rows(); ++i)
    row_of[static_cast<std::size_t>(table.number(i, "step"))] = i;
  return row_of;
}

TEST(ViewSystemTest, APageSeesTheFlightThatIsRecorded) {
  Flight flight(scenario("figure_eight"), {{}, kRealtime, {}});
  const auto viewer = start_viewer(flight.domain);
  PageClient page(wait_for_port(*viewer));
  ASSERT_TRUE(page.wait_for_step(500)) << viewer->output() << flight.outputs();
  EXPECT_EQ(page.last("run").at("run").at("scenario"), "figure_eight");
  EXPECT_EQ(page.last("status").at("participants").size(), 2u);
  ASSERT_TRUE(flight.wait_for_steps(500));
  EXPECT_EQ(page.control("stop").at("accepted"), true);
  EXPECT_TRUE(page.wait_for_status("phase", "failed"));
  flight.wait();

  const auto rows = page.rows();
  ASSERT_GT(rows.size(), 100u);
  const Table states(flight.recording() / "state.csv");
  const Table commands(flight.recording() / "command.csv");
  const Table references(flight.recording() / "reference.csv");
  const auto command_of = index_steps(commands), reference_of = index_steps(references);
  for (const auto& [time, row] : rows) {
    const auto step = static_cast<std::size_t>(std::lround(time / 0.004));
    ASSERT_LT(step, states.rows());
    ASSERT_NEAR(states.number(step, "sim_time_s"), time, 1e-9);
    ASSERT_FLOAT_EQ(row[0], static_cast<float>(states.number(step, "quad_x_m")));
    ASSERT_FLOAT_EQ(row[8], static_cast<float>(states.number(step, "load_z_m")));
    // The last step has no answer. On a busy machine an answer may be late: the recording has its
    // reference, the page has not.
    const auto command = command_of.find(step);
    ASSERT_TRUE(command != command_of.end() || step == states.rows() - 1) << step;
    const std::string fault =
        command == command_of.end() ? "no answer" : commands.text(command->second, "fault");
    if (fault == "no answer" || fault == "held" || fault == "fail_safe")
      ASSERT_TRUE(std::isnan(row[26])) << step << " " << fault;
    else
      ASSERT_FLOAT_EQ(row[26],
                      static_cast<float>(references.number(reference_of.at(step), "ref_x_m")));
  }
}

/// A stopped viewer is the worst case: it reads nothing from its sockets.
TEST(ViewSystemTest, ThreeViewersOfWhichOneIsStoppedChangeNothing) {
  const Programs programs;  // the flight must not begin before its viewers
  std::vector<std::unique_ptr<Process>> viewers;
  std::vector<std::unique_ptr<PageClient>> pages;
  for (int i = 0; i < 3; ++i) {
    viewers.push_back(start_viewer(programs.domain));
    pages.push_back(std::make_unique<PageClient>(wait_for_port(*viewers.back())));
  }
  const auto recording = programs.recording();
  const Words flags = {"--scenario", scenario("figure_eight")};
  const auto recorder = programs.start("recorder", {"--out", recording}),
             server = programs.start("sim_server", flags),
             client = programs.start("control_client", flags);
  ASSERT_TRUE(pages[0]->wait_for_step(10)) << viewers[0]->output() << server->output();
  viewers[0]->send(SIGSTOP);
  expect_success({server.get(), client.get(), recorder.get()});
  EXPECT_TRUE(pages[1]->wait_for_status("phase", "finished"));
  EXPECT_TRUE(pages[2]->wait_for_status("phase", "finished"));
  viewers[0]->send(SIGCONT);

  EXPECT_TRUE(read_manifest(recording).at("complete").get<bool>());
  expect_undisturbed(recording, scenario("figure_eight"));
}

std::vector<std::string> make_launch(const OwnDomain& domain, const std::string& recording) {
  return {"env",
          "SLS_BUILD=" SLS_BUILD_DIR,
          SLS_SOURCE_DIR "/sls",
          "run",
          scenario("short"),
          "--mode",
          "realtime",
          "--rtf",
          "0.25",  // 8 s: on a busy machine the viewer takes seconds to start
          "--domain",
          domain.text(),
          "--out",
          recording,
          "--view",
          "--view-port",
          "0"};
}

TEST(ViewSystemTest, TheLauncherShowsAFlightFromItsBeginningAndEndsTheViewerWithIt) {
  const OwnDomain domain;
  const TemporaryFolder folder;
  Process run(make_launch(domain, folder / "recording"));
  const auto port = wait_for_port(run);
  PageClient page(port);
  EXPECT_TRUE(page.wait_for_step(100)) << run.output();
  EXPECT_EQ(run.wait(), 0) << run.output();
  EXPECT_THROW(RawClient{port}, std::runtime_error) << "nobody listens any more";
  EXPECT_TRUE(read_manifest(folder / "recording").at("complete").get<bool>());
}

TEST(ViewSystemTest, AStopSignalEndsItLikeTheOtherPrograms) {
  const OwnDomain domain;
  for (const auto& [signal, code] : {std::pair(SIGINT, 130), std::pair(SIGTERM, 143)}) {
    const auto viewer = start_viewer(domain);
    const PageClient page(wait_for_port(*viewer));
    viewer->send(signal);
    EXPECT_EQ(viewer->wait(), code) << viewer->output();
  }
}

TEST(ViewSystemTest, BadUsageIsOneLineAndExitCode2) {
  const OwnDomain domain;
  const auto expect_refused = [&](const std::vector<std::string>& flags, const std::string& text) {
    Process viewer(make_command("sls_view", domain.number(), flags));
    EXPECT_EQ(viewer.wait(), 2) << viewer.output();
    const std::string output = viewer.output();
    EXPECT_NE(output.find(text), std::string::npos) << output;
    EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 1) << output;
  };
  expect_refused({"--listen", "0.0.0.0", "--port", "0"}, "--token-file");
  expect_refused({"--listen", "nowhere", "--port", "0"}, "--listen");
  expect_refused({"--port", "99999"}, "--port: expected 0 to 65535, got '99999'");
  expect_refused({"--token-file", "/nowhere/token"}, "/nowhere/token");
  expect_refused({"--export", "/tmp/page.html"}, "--export: expected a recording");
  const auto first = start_viewer(domain);
  const std::string port = std::to_string(wait_for_port(*first));
  expect_refused({"--port", port}, "--port: expected a free port, got " + port);
}

/// Memory of a process in the system, in bytes.
std::size_t find_memory(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  std::string word;
  while (status >> word && word != "VmRSS:") {
  }
  std::size_t kilobytes = 0;
  status >> kilobytes;
  return kilobytes * 1024;
}

TEST(ViewSystemTest, AnOperatorGetsInBeside300ClientsThatDoNotRead) {
  const OwnDomain domain;
  const TemporaryFolder folder;
  const std::string token = "0123456789abcdef";
  write_bytes(folder / "token", token);
  std::filesystem::permissions(folder / "token", std::filesystem::perms(0600));
  const auto viewer = start_viewer(domain, {"--token-file", (folder / "token").string()});
  const std::uint16_t port = wait_for_port(*viewer);
  FakeServer server(domain.number(), 1);
  server.publish(RunPhase::PHASE_RUNNING);
  std::uint64_t step = 0;
  const auto fly = [&] {
    server.write(make_batch(1, step, step + 9));
    step += 10;
  };
  {
    const PageClient page(port);
    ASSERT_TRUE(wait_until([&] { return fly(), page.poses().has_value(); })) << viewer->output();
  }
  const std::size_t idle = find_memory(viewer->id());

  std::string subscribe = R"({"op":"subscribe","subscriptions":[)";
  std::vector<RawClient> hostile;
  for (int i = 0; i < 300; ++i) {
    if (i % 3 == 0) {
      hostile.emplace_back(port);
    } else if (i % 3 == 1) {
      hostile.push_back(open_websocket(port, "sls.view.1"));
    } else {
      hostile.push_back(open_websocket(port, "foxglove.websocket.v1"));
      std::string list;
      for (int channel = 1; channel <= 17; ++channel)
        list += (list.empty() ? "" : ",") +
                nlohmann::json{{"id", 100 * i + channel}, {"channelId", channel}}.dump();
      hostile.back().send(to_bytes({kText, subscribe + list + "]}"}));
      hostile.back().send(to_bytes({kText, std::string(60'000, ' '), false}));  // the first half
    }
  }
  std::size_t most = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(4);
  ASSERT_TRUE(wait_until([&] {
    fly();
    most = std::max(most, find_memory(viewer->id()));
    return std::chrono::steady_clock::now() > end;
  }));
  EXPECT_LE(most - idle, std::size_t{64} << 20);
  RecordProperty("megabytes", std::to_string((most - idle) >> 20));

  PageClient page(port);
  page.say({{"op", "authenticate"}, {"token", token}});
  EXPECT_TRUE(wait_until([&] {
    const auto hello = page.last("hello");
    return fly(), !hello.is_null() && hello.at("may_operate") == true && page.poses().has_value();
  }));
}

}  // namespace
}  // namespace sls::test
