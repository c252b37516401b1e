#include "common/bus/fastdds/transports.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace sls::bus {
namespace {

using dds::TransportConfigQos;

TransportConfigQos make_transports(const std::vector<TransportDescriptor>& own) {
  TransportConfigQos transports;
  transports.use_builtin_transports = false;
  transports.user_transports = own;
  return transports;
}

TransportDescriptor make_shared_memory() {
  return std::make_shared<rtps::SharedMemTransportDescriptor>();
}

TransportDescriptor make_udp(const std::vector<std::string>& addresses) {
  auto udp = std::make_shared<rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = addresses;
  return udp;
}

TEST(TransportsTest, SharedMemoryAndLoopbackStayOnThisMachine) {
  EXPECT_TRUE(are_local(make_transports({make_shared_memory()})));
  EXPECT_TRUE(are_local(make_transports({make_udp({"127.0.0.1"})})));
  EXPECT_TRUE(
      are_local(make_transports({make_shared_memory(), make_udp({"127.0.0.1", "127.1.2.3"})})));
}

TEST(TransportsTest, AnyOtherInterfaceLeavesThisMachine) {
  EXPECT_FALSE(are_local(make_transports({make_udp({})})));  // every interface
  EXPECT_FALSE(are_local(make_transports({make_udp({"127.0.0.1", "10.0.0.1"})})));
  EXPECT_FALSE(are_local(make_transports({make_udp({"12.7.0.1"})})));
  EXPECT_FALSE(are_local(make_transports({make_shared_memory(), make_udp({"10.0.0.1"})})));
  EXPECT_FALSE(are_local(make_transports({})));
  TransportConfigQos builtin = make_transports({make_shared_memory()});
  builtin.use_builtin_transports = true;
  EXPECT_FALSE(are_local(builtin));
}

std::uint32_t queue_of(const TransportDescriptor& transport) {
  return std::dynamic_pointer_cast<rtps::SharedMemTransportDescriptor>(transport)
      ->port_queue_capacity();
}

TEST(TransportsTest, ALongQueueIsShortenedForThisParticipantAlone) {
  const auto long_one = std::make_shared<rtps::SharedMemTransportDescriptor>();
  const auto short_one = std::make_shared<rtps::SharedMemTransportDescriptor>();
  long_one->port_queue_capacity(4096);
  short_one->port_queue_capacity(100);
  TransportConfigQos transports = make_transports({long_one, short_one, make_udp({"127.0.0.1"})});
  shorten_queue(transports);
  EXPECT_EQ(queue_of(transports.user_transports.at(0)), 128U);
  EXPECT_EQ(queue_of(transports.user_transports.at(1)), 100U);
  EXPECT_EQ(queue_of(long_one), 4096U) << "the profile serves other participants, too";
}

}  // namespace
}  // namespace sls::bus
