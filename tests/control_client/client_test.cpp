/// The client over DDS, with a server that this test plays.
#include "control_client/client.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/control_client/sample_scenarios.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/waiting.hpp"

namespace sls::control {
namespace {

using sls::test::own_domain;
using sls::test::wait_until;

constexpr std::uint64_t kRun = 77;
const std::filesystem::path kQosFile = SLS_SOURCE_DIR "/config/qos/default.xml";

/// Computes until it is told to return.
class SlowLaw : public ControlLaw {
 public:
  SlowLaw(std::atomic<bool>& is_computing, const std::atomic<bool>& may_return)
      : is_computing_(is_computing), may_return_(may_return) {}
  LawOutput calc(const LawInput&) const override {
    is_computing_ = true;
    wait_until([this] { return may_return_.load(); });
    return {};
  }

 private:
  std::atomic<bool>& is_computing_;
  const std::atomic<bool>& may_return_;
};

class ClientTest : public testing::Test {
 protected:
  ~ClientTest() override {
    may_return_ = is_stopped_ = true;
    if (client_.joinable()) client_.join();
    if (publishing_.joinable()) publishing_.join();
  }

  void start_client() {
    client_ = std::thread([this] {
      bus::Node node(kQosFile, own_domain(), "client");
      ClientOptions options;
      options.make_law = [this](const LawSetup&) {
        return std::make_unique<const SlowLaw>(is_computing_, may_return_);
      };
      options.is_stopped = [this] { return is_stopped_.load(); };
      Client(node, make_figure_eight(), {0}, options).run();
    });
  }

  void claim_vehicle() {
    Parameters parameters;
    parameters.contract_sha256(bus::kContractSha256);
    parameters.run_id(kRun);
    parameters.vehicles().emplace_back().vehicle_id(0);
    parameters.mode(SyncMode::MODE_LOCKSTEP);
    parameters.period_ns(4'000'000);
    parameters.step_ns(1'000'000);
    parameters_writer_.write(parameters);
    publish_status();
  }
  void publish_status() {
    SimStatus status;
    status.run_id(kRun);
    status.phase(RunPhase::PHASE_WAITING);
    status_writer_.write(status);
  }
  /// In a thread, because the client may answer in it.
  void publish_state() {
    publishing_ = std::thread([this] {
      States states;
      states.run_id(kRun);
      states.vehicles().emplace_back().vehicle_id(0);
      wait_until([&] {
        states_writer_.write(states);  // may be lost
        return is_computing_ || is_stopped_;
      });
    });
  }

  std::optional<sync::Member> find(std::uint64_t run_id) const {
    const auto found = participants_.find(ParticipantRole::ROLE_CONTROLLER, run_id);
    return found.empty() ? std::nullopt : std::optional(found.front());
  }
  /// Waits for `count` further announcements of the same content.
  bool hears_announcements(std::uint64_t run_id, int count) {
    const auto version = participants_.version();
    auto heard = find(run_id)->heard;
    for (int i = 0; i < count; ++i) {
      if (!wait_until([&] {
            publish_status();
            return find(run_id)->heard > heard;
          }))
        return false;
      heard = find(run_id)->heard;
    }
    return participants_.version() == version;
  }

  std::atomic<bool> is_computing_{false}, may_return_{false}, is_stopped_{false};
  bus::Node node_{kQosFile, own_domain(), "server"};
  bus::ParticipantDirectory participants_{node_};
  bus::Writer<Parameters> parameters_writer_{node_};
  bus::Writer<SimStatus> status_writer_{node_};
  bus::Writer<States> states_writer_{node_, bus::kLoopWriterProfile};
  bus::Reader<Commands> commands_reader_{node_, bus::kLoopReaderProfile,
                                         [](const Commands&, const bus::PeerId&) {}};
  std::thread client_, publishing_;
};

TEST_F(ClientTest, RepeatsItsAnnouncementWhileItWaitsForAServer) {
  start_client();
  ASSERT_TRUE(wait_until([&] { return find(0).has_value(); }));
  EXPECT_TRUE(hears_announcements(0, 3));
}

TEST_F(ClientTest, RepeatsItsAnnouncementBeforeTheStartAndWhileItsLawComputes) {
  claim_vehicle();
  start_client();
  ASSERT_TRUE(wait_until([&] {
    publish_status();
    return find(kRun) && find(kRun)->announcement.ready();
  }));
  EXPECT_TRUE(hears_announcements(kRun, 3));
  publish_state();
  ASSERT_TRUE(wait_until([&] { return is_computing_.load(); }));
  EXPECT_TRUE(hears_announcements(kRun, 3));
  EXPECT_TRUE(find(kRun)->is_repeated);
}

}  // namespace
}  // namespace sls::control
