/// Probes over loopback; networks that lose them: tests/network/doctor_test.cpp.
#include "tools/doctor/probe.hpp"

#include <gtest/gtest.h>

#include "tests/support/waiting.hpp"

namespace sls::doctor {
namespace {

/// Ports above those of all domains that are in use here.
Ports make_ports() {
  Ports ports;
  ports.domain = 101;
  return ports;
}

TEST(ProbeTest, AnAnswererAnswersFromThePortThatWasAskedAndFromAnother) {
  ProbeAnswerer answerer(make_ports());
  Prober prober(make_ports(), "127.0.0.1", {"127.0.0.1"}, false);
  ASSERT_TRUE(test::wait_until([&] {
    prober.work();
    answerer.answer(std::chrono::milliseconds(1));
    const ProbeResults results = prober.results();
    return prober.is_done() && results.is_answered_unasked && results.is_multicast_answered;
  }));
  const ProbeResults results = prober.results();
  EXPECT_TRUE(results.is_answered);
  for (const auto& [size, is_whole] : results.sizes) EXPECT_TRUE(is_whole) << size;
  ASSERT_TRUE(results.clock_ahead);
  EXPECT_LT(std::chrono::abs(*results.clock_ahead), std::chrono::milliseconds(100));
}

TEST(ProbeTest, WithoutAnAnswererTheHostRefuses) {
  Ports ports = make_ports();
  ports.domain = 102;
  Prober prober(ports, "127.0.0.1", {}, false);
  ASSERT_TRUE(test::wait_until([&] {
    prober.work();
    return prober.is_done();
  }));
  const ProbeResults results = prober.results();
  EXPECT_TRUE(results.is_refused);
  EXPECT_FALSE(results.is_answered);
  EXPECT_FALSE(results.clock_ahead);
  for (const auto& [size, is_whole] : results.sizes) EXPECT_TRUE(is_whole) << size;
}

}  // namespace
}  // namespace sls::doctor
