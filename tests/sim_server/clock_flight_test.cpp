/// A real-time flight over DDS with a client of this test, which stamps its samples with a clock of
/// its own, as a client on another machine does.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "fastdds_api.hpp"
#include "sim_server/server.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/waiting.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;
namespace dds = bus::dds;
using sls::test::own_domain;
using sls::test::wait_until;

const std::filesystem::path kQosFile = SLS_SOURCE_DIR "/config/qos/default.xml";

config::Scenario make_scenario() {
  return config::parse_scenario(
      "name: hover\n"
      "vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }\n"
      "plant: { model: analytic, initial: { load_position_m: [0, 0, -1] } }\n"
      "mission: [{ hold: { position_m: [0, 0, -1] }, for_s: 3600 }]\n"
      "sync: { mode: realtime, period_s: 0.02, wait_for: { recorders: 0, timeout_s: 60 } }\n",
      "hover.yaml");
}

/// Writes samples with a time stamp.
class StampedWriters {
 public:
  StampedWriters() {
    auto* factory = dds::DomainParticipantFactory::get_instance();
    participant_ = factory->create_participant(own_domain(), dds::PARTICIPANT_QOS_DEFAULT);
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    announcements_ = make_writer<Participant>();
    commands_ = make_writer<Commands>();
  }
  ~StampedWriters() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  StampedWriters(const StampedWriters&) = delete;
  StampedWriters& operator=(const StampedWriters&) = delete;

  void announce(Participant message, std::chrono::nanoseconds ahead) {
    write(*announcements_, &message, ahead);
  }
  void answer(Commands message, std::chrono::nanoseconds ahead) {
    write(*commands_, &message, ahead);
  }

 private:
  template <class Message>
  dds::DataWriter* make_writer() {
    dds::TypeSupport type(
        static_cast<dds::TopicDataType*>(bus::detail::make_type_support<Message>()));
    bus::leave_out_type_object(type);
    type.register_type(participant_);
    auto* topic = participant_->create_topic(bus::Topic<Message>::kName, type.get_type_name(),
                                             dds::TOPIC_QOS_DEFAULT);
    dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = dds::TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.history().depth = 32;
    if (std::is_same_v<Message, Commands>) qos.deadline().period = {0, 100'000'000};
    return publisher_->create_datawriter(topic, qos);
  }
  static void write(dds::DataWriter& writer, void* message, std::chrono::nanoseconds ahead) {
    const std::chrono::nanoseconds now = std::chrono::system_clock::now().time_since_epoch();
    const auto stamp = (now + ahead).count();
    const bus::Time time(static_cast<std::int32_t>(stamp / 1'000'000'000),
                         static_cast<std::uint32_t>(stamp % 1'000'000'000));
    bus::write_sample(writer, message, time);
  }

  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::DataWriter* announcements_ = nullptr;
  dds::DataWriter* commands_ = nullptr;
};

class ClockFlightTest : public testing::Test {
 protected:
  ~ClockFlightTest() override {
    is_over_ = true;
    if (answering_.joinable()) answering_.join();
    if (flying_.joinable()) flying_.join();
  }

  void start_server() {
    flying_ = std::thread([this] {
      bus::Node node(kQosFile, own_domain(), "server");
      try {
        Server(node, {scenario_, {0}}, 1).run();
      } catch (const std::exception&) {  // stopped by this test
      }
    });
    ASSERT_TRUE(wait_until([&] {
      run_ = servers_.find_joinable(0);
      return run_.has_value();
    }));
  }

  /// Announces the client once, with a stamp that is `delay` old already.
  void join(std::chrono::nanoseconds delay = 0ns) {
    Participant message;
    message.run_id(run_->parameters.run_id());
    message.contract_sha256(bus::kContractSha256);
    message.role(ParticipantRole::ROLE_CONTROLLER);
    message.name("pilot");
    message.host("box");
    message.vehicle_ids({0});
    message.scenario_sha256(scenario_.sha256);
    message.ready(true);
    writers_.announce(message, ahead_.load() - delay);
    answering_ = std::thread([this] { answer_states(); });
  }

  void stop_server() {
    SimControl request;
    request.run_id(run_->parameters.run_id());
    request.action(ControlAction::ACTION_STOP);
    bus::Writer<SimControl> requests(node_);
    requests.write(request);
    EXPECT_TRUE(wait_until([&] {
      const auto status = servers_.find_status(run_->parameters.run_id());
      return status && sync::calc_progress(status->phase()) < 0;
    }));
  }

  bool has_event(const std::string& words) const {
    const std::lock_guard lock(mutex_);
    return events_.find(words) != std::string::npos;
  }
  std::string events() const {
    const std::lock_guard lock(mutex_);
    return events_;
  }
  /// Waits until the server has taken the answers to `steps` further steps.
  bool flies(std::uint64_t steps) {
    const std::uint64_t end = accepted_ + steps;
    return wait_until([&] { return accepted_ >= end; });
  }

  std::atomic<std::int64_t> link_delay_ns_{0};  // each way
  std::atomic<std::chrono::nanoseconds> ahead_{0ns};

 private:
  struct Waiting {
    States states;
    std::chrono::steady_clock::time_point due;
  };
  void receive(const States& states) {
    if (states.vehicles().front().controller_name() == "pilot") ++accepted_;
    const std::lock_guard lock(mutex_);
    waiting_.push_back(
        {states, std::chrono::steady_clock::now() + std::chrono::nanoseconds(link_delay_ns_)});
  }
  /// Answers after the delay of the way there, with the stamp of that time; sends the answer after
  /// the delay of the way back.
  void answer_states() {
    struct Sent {
      Commands commands;
      std::chrono::steady_clock::time_point due;
    };
    std::vector<Sent> sent;
    while (!is_over_) {
      std::this_thread::sleep_for(1ms);
      const auto now = std::chrono::steady_clock::now();
      {
        const std::lock_guard lock(mutex_);
        while (!waiting_.empty() && waiting_.front().due <= now) {
          const auto delay = std::chrono::nanoseconds(link_delay_ns_);
          sent.push_back({make_answer(waiting_.front().states), now + delay});
          waiting_.erase(waiting_.begin());
        }
      }
      while (!sent.empty() && sent.front().due <= now) {
        const std::chrono::nanoseconds age(link_delay_ns_);
        writers_.answer(sent.front().commands, ahead_.load() - age);
        sent.erase(sent.begin());
      }
    }
  }
  Commands make_answer(const States& states) const {
    const auto& vehicle = scenario_.vehicle;
    ControlCommand command;
    command.vehicle_id(0);
    command.f_Q_W_n({0.0, 0.0, -(vehicle.quad_mass + vehicle.load_mass) * vehicle.gravity});
    Commands commands;
    commands.run_id(states.run_id());
    commands.step(states.step());
    commands.client_name("pilot");
    commands.vehicles({command});
    return commands;
  }
  void note(const SimStatus& status) {
    const std::lock_guard lock(mutex_);
    events_ += status.reason().to_string() + "\n";
  }

  const config::Scenario scenario_ = make_scenario();
  mutable std::mutex mutex_;
  std::string events_;
  std::vector<Waiting> waiting_;
  std::atomic<std::uint64_t> accepted_{0};  // states that show an answer of the client in force
  std::atomic<bool> is_over_{false};
  StampedWriters writers_;
  bus::Node node_{kQosFile, own_domain(), "operator"};
  bus::ServerDirectory servers_{node_, [this](const SimStatus& status) { note(status); }};
  bus::Reader<States> states_{
      node_, bus::kLoopReaderProfile,
      [this](const States& states, const bus::PeerId&) { receive(states); }};
  std::optional<sync::Run> run_;
  std::thread flying_, answering_;
};

// LIFESPAN would drop every answer.
TEST_F(ClockFlightTest, AClockBehindIsNamedAndTheVehicleFliesAndLaterItsClockIsRight) {
  start_server();
  ahead_ = -1s;
  join();
  EXPECT_TRUE(flies(50)) << events();
  EXPECT_TRUE(wait_until([&] {
    return has_event("the clock of controller 'pilot' on box is 1.00 s behind ours");
  })) << events();
  ahead_ = 0s;
  EXPECT_TRUE(wait_until([&] {
    return has_event("the clock of controller 'pilot' on box agrees with ours again");
  })) << events();
  EXPECT_TRUE(flies(50)) << "with LIFESPAN: " << events();
  ahead_ = 1s;
  EXPECT_TRUE(wait_until([&] { return has_event("is 1.00 s ahead of ours"); })) << events();
  stop_server();
}

TEST_F(ClockFlightTest, LinkDelayAndADelayedAnnouncementAreNoWrongClock) {
  start_server();
  link_delay_ns_ = 80'000'000;  // each way; an answer older than 0.2 s is refused
  join(5s);
  EXPECT_TRUE(flies(250)) << events();
  EXPECT_FALSE(has_event("the clock of")) << events();
  stop_server();
}

}  // namespace
}  // namespace sls::sim
