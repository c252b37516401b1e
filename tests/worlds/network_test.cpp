// The simulated network: rules that the conformance scripts do not show.
#include "worlds/network.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;

class SimulatedNetworkTest : public testing::Test {
 protected:
  /// A participant on a host of its own.
  struct Node {
    Node(Timeline& timeline, Network& network)
        : host(timeline, "host", 100s, 0, 0s),
          process(timeline, host, "program"),
          peer(network.join(process)) {}
    Host host;
    Process process;
    Peer& peer;
    std::vector<std::uint64_t> heard;  // run ids of the samples
  };

  Node& add() { return *nodes_.emplace_back(std::make_unique<Node>(timeline_, network_)); }
  template <class Message>
  Node& add_writer() {
    Node& node = add();
    node.peer.add_writer<Message>();
    network_.announce(node.peer);
    return node;
  }
  template <class Message>
  Node& add_reader() {
    Node& node = add();
    node.peer.add_reader<Message>([&](const Message& sample, const Peer::Arrival&) {
      node.heard.push_back(sample.run_id());
    });
    network_.announce(node.peer);
    return node;
  }
  template <class Message>
  static void write(Node& node, std::uint64_t run_id) {
    Message message;
    message.run_id(run_id);
    node.peer.write(message);
  }
  void wait(Instant time) {
    const Instant end = timeline_.now() + time;
    timeline_.at(end, [] {});
    while (timeline_.step(end + Instant(1))) continue;
  }
  Link& link(const Node& from, const Node& to) { return network_.link(from.host, to.host); }

  using Heard = std::vector<std::uint64_t>;
  Timeline timeline_;
  Network network_{timeline_, Random(1)};
  std::vector<std::unique_ptr<Node>> nodes_;
};

TEST_F(SimulatedNetworkTest, BestEffortSamplesAreLostAndNeverComeInAnotherOrder) {
  Node& writer = add_writer<States>();
  Node& reader = add_reader<States>();
  wait(100ms);
  link(writer, reader) = {1ms, 3ms, 0.3, 0.2, 10ms, false};
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    write<States>(writer, i);
    wait(1ms);
  }
  wait(100ms);
  EXPECT_GT(reader.heard.size(), 100u);
  EXPECT_LT(reader.heard.size(), 750u);
  EXPECT_TRUE(std::is_sorted(reader.heard.begin(), reader.heard.end()));
  EXPECT_EQ(std::adjacent_find(reader.heard.begin(), reader.heard.end()), reader.heard.end());
}

TEST_F(SimulatedNetworkTest, NobodyIsDiscoveredThroughACutInEitherDirection) {
  Node& writer = add_writer<SimStatus>();
  Node& reader = add();
  link(reader, writer).is_cut = true;
  reader.peer.add_reader<SimStatus>([&](const SimStatus& sample, const Peer::Arrival&) {
    reader.heard.push_back(sample.run_id());
  });
  network_.announce(reader.peer);
  write<SimStatus>(writer, 1);
  wait(3s);
  EXPECT_TRUE(reader.peer.matched_writers(TopicId::kStatus).empty());
  link(reader, writer).is_cut = false;
  wait(1s);
  EXPECT_EQ(reader.heard, Heard{1}) << "its announcements are repeated";
}

TEST_F(SimulatedNetworkTest, ALeaverIsForgottenAtOnceAndAKilledOneAfterItsLease) {
  Node& one = add_writer<SimStatus>();
  Node& other = add_writer<SimStatus>();
  Node& reader = add_reader<SimStatus>();
  wait(100ms);
  EXPECT_EQ(reader.peer.matched_writers(TopicId::kStatus).size(), 2u);
  one.process.end();
  network_.leave(one.peer, true);
  other.process.end();
  network_.leave(other.peer, false);
  wait(100ms);
  EXPECT_EQ(reader.peer.matched_writers(TopicId::kStatus).count(one.peer.id()), 0u);
  wait(59s);
  EXPECT_EQ(reader.peer.matched_writers(TopicId::kStatus).count(other.peer.id()), 1u);
  wait(1s);
  EXPECT_EQ(reader.peer.matched_writers(TopicId::kStatus).count(other.peer.id()), 0u);
}

TEST_F(SimulatedNetworkTest, AStoppedReaderKeepsTheFirstDatagrams) {
  Node& writer = add_writer<States>();
  Node& reader = add_reader<States>();
  wait(100ms);
  reader.process.stop();
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    write<States>(writer, i);
    wait(1ms);
  }
  reader.process.go_on();
  ASSERT_EQ(reader.heard.size(), 400u);
  EXPECT_EQ(reader.heard.back(), 400u);
}

}  // namespace
}  // namespace sls::worlds
