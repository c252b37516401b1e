#include "common/bus/fastdds/refusals.hpp"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <sstream>

#include "common/bus/fastdds/middleware_log.hpp"
#include "common/bus/fastdds/participant_listener.hpp"
#include "tests/support/waiting.hpp"

namespace sls::bus {
namespace {

/// Log lines of refusals, with the process's log in place of stderr.
class RefusalsTest : public testing::Test {
 protected:
  RefusalsTest() : logger_(spdlog::default_logger()) {
    const auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(said_);
    sink->set_pattern("%v");
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", sink));
  }
  ~RefusalsTest() override { spdlog::set_default_logger(logger_); }

  std::size_t lines() const {
    const std::string text = said_.str();
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }

  std::ostringstream said_;
  Refusals refusals_;

 private:
  std::shared_ptr<spdlog::logger> logger_;
};

TEST_F(RefusalsTest, NameParticipantAndCauseOnce) {
  refusals_.note_discovered("01.0f", "'recorder' (10.77.0.3, 01.0f)");
  refusals_.note_refused("01.0f", "it has no identity");
  refusals_.note_refused("01.0f", "it has no identity");
  EXPECT_EQ(said_.str(), "refused 'recorder' (10.77.0.3, 01.0f): it has no identity\n");
}

TEST_F(RefusalsTest, TakeTheCauseThatTheMiddlewareLoggedJustBefore) {
  refusals_.note_discovered("01.0f", "'recorder'", "'CN=recorder'");
  refusals_.note_cause("Invalidation error of certificate  (certificate has expired)");
  refusals_.note_cause("Error verifying certificate");
  refusals_.note_refused("01.0f");
  EXPECT_EQ(said_.str(),
            "refused 'recorder': its certificate is not accepted (certificate has expired)\n");
}

TEST_F(RefusalsTest, AreAlsoReadFromTheLogAlone) {
  refusals_.note_discovered("01.0f", "'recorder'", "'CN=recorder'");
  refusals_.note_cause(
      "Error validating remote permissions for 01.0f|0.0.1.c1 (Failed verification of the "
      "permissions file (./src/cpp/security/accesscontrol/Permissions.cpp:565)).");
  EXPECT_EQ(said_.str(),
            "refused 'recorder': its permissions are not signed by our permissions authority\n");
}

TEST_F(RefusalsTest, ThePlaceInTheSourcesIsLeftOut) {
  for (const std::string folder : {".", "/tmp/build/dds"})
    EXPECT_EQ(trim_place("no rule. (" + folder + "/src/cpp/security/Permissions.cpp:1)"),
              "no rule");
  EXPECT_EQ(trim_place("no rule (of ours)."), "no rule (of ours)");
}

TEST_F(RefusalsTest, AParticipantWithoutProofIsReportedInTime) {
  refusals_.note_discovered("01.0f", "'accepted'", "'CN=controller'");
  const pid_t killed = ::fork();
  if (killed == 0) ::_exit(0);
  std::string process = Refusals::name_process();
  refusals_.note_discovered(
      "04.0f", "'killed'", "'CN=recorder'",
      process.replace(process.rfind(' ') + 1, process.npos, std::to_string(killed)));
  refusals_.note_discovered("02.0f", "'silent'", "'CN=recorder' of 'CN=another'",
                            Refusals::name_process());
  refusals_.note_accepted("01.0f");
  refusals_.note_accepted("03.0f");  // Fast DDS 3 tells both in this order
  refusals_.note_discovered("03.0f", "'accepted first'", "'CN=recorder'");
  ASSERT_TRUE(test::wait_until([&] { return lines() > 0; }));
  EXPECT_EQ(said_.str(),
            "refused 'silent': no proof of an identity that holds here within 5 s; it claims "
            "'CN=recorder' of 'CN=another'\n");
  ::waitpid(killed, nullptr, 0);
}

TEST_F(RefusalsTest, AFloodOfThemIsFiveLines) {
  for (int i = 0; i < 5000; ++i) {
    const std::string guid = std::to_string(i) + ".0f";
    refusals_.note_discovered(guid, guid);
    refusals_.note_refused(guid, "it has no identity");
  }
  EXPECT_EQ(lines(), static_cast<std::size_t>(Refusals::kMostLines));
}

/// Discovers a participant without a name, at an unknown address.
void discover(ParticipantListener& listener, std::uint8_t number, bool is_secured,
              const rtps::VendorId_t& vendor) {
  ParticipantNews news;
  news.guid.guidPrefix.value[0] = number;
  news.vendor = vendor;
  if (is_secured) news.identity.emplace();
  listener.on_participant(nullptr, news);
}

constexpr rtps::VendorId_t kFastDds = {1, 15}, kCyclone = {1, 16};

TEST_F(RefusalsTest, AParticipantWithoutANameIsDescribedAsSuch) {
  ParticipantListener listener({false});
  discover(listener, 1, true, kFastDds);
  EXPECT_EQ(said_.str(),
            "refused a participant without a name (01.00.00.00.00.00.00.00.00.00.00.00): it is "
            "secured, this is not (--qos config/qos/secure.xml)\n");
}

TEST_F(RefusalsTest, ASecuredFlightNeedsOneVersion) {
  const bool is_old = !has_secure_announcements(kMiddlewareVersion);
  std::uint8_t number = 4;
  for (const bool is_secured : {false, true})
    for (const char* version : {"2.9.1", "3.1.2"}) {
      said_.str("");
      ParticipantListener listener({is_secured});
      ParticipantNews news;
      news.guid.guidPrefix.value[0] = ++number;
      if (is_secured) news.identity.emplace();
      news.properties[kVersionProperty] = version;
      listener.on_participant(nullptr, news);
      const bool is_apart = is_secured && is_old != (version[0] == '2');
      EXPECT_EQ(said_.str().find(
                    "its Fast DDS is " + std::string(version) + ", this one " + kMiddlewareVersion +
                    ": expected one version in a secured flight\n") != std::string::npos,
                is_apart)
          << said_.str();
    }
}

TEST_F(RefusalsTest, AProgramWithAnotherBuildIsNamedOnceIfBothHaveSharedMemory) {
  for (const bool has_memory : {false, true}) {
    said_.str("");
    ParticipantListener::Own own;
    own.has_memory = has_memory;
    ParticipantListener listener(own);
    ParticipantNews news;
    for (const int build : {0, int{middleware_build()}, 0}) {
      news.name = build == 0 ? "recorder" : "sim_server";
      news.properties = {{kVersionProperty, "3.1.2"}, {kMemoryProperty, std::to_string(build)}};
      ++news.guid.guidPrefix.value[0];
      listener.on_participant(nullptr, news);
    }
    EXPECT_EQ(said_.str(), has_memory ? "'recorder' uses another build of Fast DDS (3.1.2, here " +
                                            std::string(kMiddlewareVersion) +
                                            "): UDP between them, no shared memory\n"
                                      : "");
  }
}

TEST_F(RefusalsTest, OnlyKeysForOtherVendorsLetAnotherVendorsParticipantBeDiscovered) {
  for (const bool is_for_fastdds_alone : {false, true}) {
    ParticipantListener listener({true, is_for_fastdds_alone});
    PlainAnnouncement cyclone;
    cyclone.name = "cyclone";
    cyclone.is_secured = true;
    cyclone.as_secure = {1};
    listener.on_announcement(cyclone, "10.0.0.2");
    EXPECT_EQ(said_.str().find("refused 'cyclone' (10.0.0.2, ") != std::string::npos,
              is_for_fastdds_alone);
    EXPECT_EQ(said_.str().find("expected keys of ./sls keys DIR --other-vendors, got keys without "
                               "it\n") != std::string::npos,
              is_for_fastdds_alone)
        << said_.str();
  }
}

TEST_F(RefusalsTest, OnlyAnotherVendorsParticipantNeedsKeysThatProtectSubmessages) {
  for (const bool is_for_fastdds_alone : {false, true}) {
    Problems problems;
    Neighbours neighbours(problems);
    ParticipantListener listener({true, is_for_fastdds_alone}, &neighbours);
    discover(listener, 2, false, kFastDds);
    discover(listener, 3, false, kCyclone);
    for (const std::uint8_t number : {2, 3}) {
      EndpointFacts facts;
      facts.topic = "sls/command";
      PeerId peer;
      peer.bytes[0] = number;
      neighbours.note_endpoint(peer, {}, facts);
    }
    EXPECT_EQ(problems.describe(),
              is_for_fastdds_alone
                  ? "a participant without a name: another vendor's DDS: expected keys of ./sls "
                    "keys DIR --other-vendors, got keys without it"
                  : "");
  }
}

}  // namespace
}  // namespace sls::bus
