#include "common/bus/fastdds/discovered_participants.hpp"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace sls::bus {
namespace {

using Ports = std::set<int>;

PeerId make_peer(std::uint8_t number) {
  PeerId peer;
  peer.bytes[0] = number;
  return peer;
}

TEST(OpenPortsTest, AreTheDiscoveryPortsOfTheDomain) {
  test::TemporaryFolder folder;
  const std::string file = folder / "udp";
  // Ports 7409, 7410, 7412 (twice), 7413, 7630, 7910 and 53.
  test::write_bytes(
      file,
      "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid\n"
      "  11: 0100007F:1CF1 00000000:0000 07 00000000:00000000 00:00000000 00000000     0\n"
      "  12: 0100007F:1CF2 00000000:0000 07 00000000:00000000 00:00000000 00000000     0\n"
      " 113: 00000000:1CF4 00000000:0000 07 00000000:00000000 00:00000000 00000000     0\n"
      " 113: 0100007F:1CF4 00000000:0000 07 00000000:00000000 00:00000000 00000000     0\n"
      " 114: 0100007F:1CF5 00000000:0000 07 00000000:00000000 00:00000000 00000000     0\n"
      " 115: 0100007F:1DCE 00000000:0000 07 00000000:00000000 00:00000000 00000000     0\n"
      " 116: 0100007F:1EE6 00000000:0000 07 00000000:00000000 00:00000000 00000000     0\n"
      " 117: 0100007F:0035 00000000:0000 07 00000000:00000000 00:00000000 00000000     0\n");
  EXPECT_EQ(find_open_ports({7410, 2}, file), (Ports{7410, 7412}));
}

TEST(OpenPortsTest, NoneAreFoundWithoutTheTable) {
  EXPECT_EQ(find_open_ports({7410, 2}, "/nowhere"), Ports{});
}

TEST(DiscoveredParticipantsTest, APortIsUnknownUnlessAPresentParticipantHasIt) {
  DiscoveredParticipants discovered;
  EXPECT_EQ(discovered.find_unknown({7410, 7412}), (Ports{7410, 7412}));
  discovered.note(make_peer(1), "one", {7410});
  EXPECT_EQ(discovered.find_unknown({7410, 7412}), Ports{7412});
  discovered.note(make_peer(2), "two", {7412, 7500});
  EXPECT_EQ(discovered.find_unknown({7410, 7412}), Ports{});
  discovered.drop(make_peer(1));
  EXPECT_EQ(discovered.find_unknown({7410, 7412}), Ports{7410});
}

TEST(DiscoveredParticipantsTest, AreFoundByName) {
  DiscoveredParticipants discovered;
  discovered.note(make_peer(1), "server", {});
  discovered.note(make_peer(2), "client", {});
  discovered.note(make_peer(3), "server", {});
  EXPECT_EQ(discovered.find_named("server"), (std::set<PeerId>{make_peer(1), make_peer(3)}));
  discovered.drop(make_peer(3));
  EXPECT_EQ(discovered.find_named("server"), std::set<PeerId>{make_peer(1)});
}

}  // namespace
}  // namespace sls::bus
