#include "worlds/timeline.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "worlds/host.hpp"

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;

TEST(TimelineTest, EventsHappenInTheirOrder) {
  Timeline timeline;
  std::vector<int> happened;
  timeline.at(2ms, [&] { happened.push_back(3); });
  timeline.at(1ms, [&] { happened.push_back(1); });
  timeline.at(1ms, [&] {
    happened.push_back(2);
    timeline.at(0ms, [&] { happened.push_back(static_cast<int>(timeline.now().count())); });
  });
  while (timeline.step(2ms)) continue;
  EXPECT_EQ(happened, (std::vector<int>{1, 2, 1'000'000})) << "nothing before now";
  EXPECT_TRUE(timeline.step(3ms));
  EXPECT_FALSE(timeline.step(1h));
  EXPECT_EQ(timeline.now(), Instant(2ms));
}

TEST(HostTest, HasItsOwnClocks) {
  Timeline timeline;
  Host host(timeline, "box", 100s, 1e-3, 5s);
  const Host exact(timeline, "other", 0s, 0, 0s);
  timeline.at(10s, [] {});
  timeline.step(1h);
  EXPECT_EQ(host.now().time_since_epoch(), 110s + 10ms);
  EXPECT_EQ(exact.now().time_since_epoch(), Instant(10s));
  EXPECT_EQ(host.wall() - exact.wall(), 5s + 10ms);
  host.set_wall_clock(-2s);
  EXPECT_EQ(host.wall() - exact.wall(), 3s + 10ms);
  EXPECT_EQ(host.now().time_since_epoch(), 110s + 10ms) << "the monotonic clock does not jump";
  const Instant due = host.find(host.now() + 1ms);
  EXPECT_NEAR(static_cast<double>((due - timeline.now()).count()), 1e6 / 1.001, 2);
}

TEST(ProcessTest, AStoppedProcessDoesEverythingLater) {
  Timeline timeline;
  Host host(timeline, "box", 0s, 0, 0s);
  Process process(timeline, host, "program");
  std::vector<int> done;
  process.stop();
  process.run([&] { done.push_back(1); });
  process.run([&] {
    done.push_back(2);
    process.stop();
  });
  process.run([&] { done.push_back(3); });
  EXPECT_TRUE(done.empty());
  process.go_on();
  EXPECT_EQ(done, (std::vector<int>{1, 2})) << "it was stopped again";
  process.end();
  process.go_on();
  EXPECT_EQ(done, (std::vector<int>{1, 2})) << "it has ended";
}

}  // namespace
}  // namespace sls::worlds
