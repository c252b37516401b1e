/// A foreign controller on plain Fast DDS. It makes one mistake (--mistake) and otherwise follows
/// idl/README.md: it keeps a resting vehicle in place. It prints "begins" when its mistake first
/// becomes visible, and ends at SIGTERM.
#include <slsPubSubTypes.h>

#include <CLI/CLI.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include <array>
#include <chrono>
#include <csignal>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "common/app/stop_signal.hpp"
#include "other_type.hpp"

namespace {

using namespace sls;
namespace dds = bus::dds;
namespace rtps = bus::rtps;
using bus::is_ok;
using bus::write_sample;
using foreign::Edit;
using foreign::kEnd;
using foreign::OtherType;
using namespace std::chrono_literals;

struct Options {
  int domain = 0;
  std::string mistake = "none";
  std::string name = "foreign";
};

class ForeignClient {
 public:
  explicit ForeignClient(const Options& options) : options_(options) {
    dds::DomainParticipantQos qos = dds::PARTICIPANT_QOS_DEFAULT;
    qos.name(options.name.c_str());
    qos.transport().use_builtin_transports = false;
    const auto udp = std::make_shared<rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.push_back("127.0.0.1");
    qos.transport().user_transports.push_back(udp);
    participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
        static_cast<std::uint32_t>(options.domain), qos);
    if (!participant_) throw std::runtime_error("cannot join");
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
    create_endpoints();
  }
  ~ForeignClient() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  ForeignClient(const ForeignClient&) = delete;
  ForeignClient& operator=(const ForeignClient&) = delete;

  void run() {
    if (is_visible_by_itself()) say_that_it_begins();
    while (app::stop_signal() == 0) {
      look_for_run();
      if (parameters_ && makes("impostor")) play_the_server();
      if (parameters_ && state_reader_) fly();
      std::this_thread::sleep_for(1ms);
    }
  }

 private:
  bool makes(const char* mistake) const { return options_.mistake == mistake; }

  bool is_visible_by_itself() const {
    for (const char* mistake :
         {"volatile", "best_effort", "exclusive", "state_deadline", "other_type", "keyed",
          "no_deadline", "record_deadline", "unannounced", "similar_topic", "ros_topic",
          "states_without_claim"})
      if (makes(mistake)) return true;
    return false;
  }

  void say_that_it_begins() {
    if (!std::exchange(has_begun_, true)) std::cout << "begins" << std::endl;
  }

  // --- endpoints ---

  template <class Generated>
  dds::Topic* create_topic(const char* name, const Edit& edit = {},
                           const std::string& type_name = {}, bool is_keyed = false) {
    auto* type = new OtherType<Generated>(edit);
    if (!type_name.empty()) type->set_type_name(type_name);
    if (is_keyed) type->set_keyed();
    const dds::TypeSupport support(type);
    support.register_type(participant_);
    return participant_->create_topic(name, support.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  }

  dds::DataReader* create_reader(dds::Topic* topic, bool is_latched) const {
    dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
    qos.reliability().kind =
        is_latched ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind =
        is_latched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
    qos.history().depth = 64;
    qos.data_sharing().off();
    qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    if (makes("state_deadline") && topic->get_name() == "sls/state")
      qos.deadline().period = bus::Duration(0.01);
    if (makes("record_deadline") && topic->get_name() == "sls/record")
      qos.deadline().period = bus::Duration(0.01);
    return subscriber_->create_datareader(topic, qos);
  }

  dds::DataWriterQos make_writer_qos() const {
    dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = dds::TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.history().depth = 64;
    qos.data_sharing().off();
    qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    return qos;
  }

  void create_endpoints() {
    if (makes("record_deadline")) {
      create_reader(create_topic<RecordBatchPubSubType>("sls/record"), true);
      return;
    }
    if (makes("impostor") || makes("states_without_claim")) {
      create_writers_of_a_server();
      return;
    }
    if (!makes("unannounced")) create_announcement_writer();
    create_command_writer();
    parameters_reader_ = create_reader(create_topic<ParametersPubSubType>("sls/parameters"), true);
    status_reader_ = create_reader(create_topic<SimStatusPubSubType>("sls/status"), true);
    if (!makes("no_state_reader"))
      state_reader_ = create_reader(create_topic<StatesPubSubType>("sls/state"), false);
  }

  void create_writers_of_a_server() {
    states_writer_ = publisher_->create_datawriter(create_topic<StatesPubSubType>("sls/state"),
                                                   make_writer_qos());
    auto* status_topic = create_topic<SimStatusPubSubType>("sls/status");
    status_writer_ = publisher_->create_datawriter(status_topic, make_writer_qos());
    parameters_reader_ = create_reader(create_topic<ParametersPubSubType>("sls/parameters"), true);
  }

  void create_announcement_writer() {
    dds::DataWriterQos qos = make_writer_qos();
    if (makes("volatile")) qos.durability().kind = dds::VOLATILE_DURABILITY_QOS;
    if (makes("best_effort")) qos.reliability().kind = dds::BEST_EFFORT_RELIABILITY_QOS;
    const Edit edit = makes("long_announcement") ? Edit{kEnd, 8} : Edit{};
    participant_writer_ = publisher_->create_datawriter(
        create_topic<ParticipantPubSubType>("sls/participant", edit), qos);
  }

  void create_command_writer() {
    dds::DataWriterQos qos = make_writer_qos();
    if (!makes("no_deadline")) qos.deadline().period = bus::Duration(0.1);
    if (makes("exclusive")) qos.ownership().kind = dds::EXCLUSIVE_OWNERSHIP_QOS;
    // After the encapsulation (4), run_id (8) and step (8).
    const Edit edit = makes("extra_field")     ? Edit{20, 8}
                      : makes("missing_field") ? Edit{12, -8}
                      : makes("retyped_field") ? Edit{12, -4}
                                               : Edit{};
    command_writer_ = publisher_->create_datawriter(
        create_topic<CommandsPubSubType>(makes("similar_topic") ? "sls/commands"
                                         : makes("ros_topic")   ? "rt/sls/command"
                                                                : "sls/command",
                                         edit, makes("other_type") ? "mine::Commands" : "",
                                         makes("keyed")),
        qos);
  }

  // --- joining and answering ---

  void look_for_run() {
    dds::SampleInfo info;
    Parameters parameters;
    while (parameters_reader_ && is_ok(parameters_reader_->take_next_sample(&parameters, &info)))
      if (info.valid_data && parameters.vehicles().size() > 0) {
        parameters_ = parameters;
        announce();
      }
    SimStatus status;
    while (status_reader_ && is_ok(status_reader_->take_next_sample(&status, &info))) {
    }
  }

  /// Says that the run of the server has failed, and sends a state of it.
  void play_the_server() {
    if (has_begun_) return;
    SimStatus status;
    status.run_id(parameters_->run_id());
    status.sample_index(1'000'000);
    status.phase(RunPhase::PHASE_FAILED);
    status.reason("forged");
    write_sample(*status_writer_, &status);
    states_.run_id(parameters_->run_id());
    states_.vehicles().resize(1);
    write_sample(*states_writer_, &states_);
    say_that_it_begins();
  }

  void announce() {
    if (!participant_writer_) return;
    Participant message;
    message.run_id(parameters_->run_id());
    message.contract_sha256(SLS_CONTRACT_SHA256);
    message.role(ParticipantRole::ROLE_CONTROLLER);
    message.name(options_.name);
    message.host("elsewhere");
    message.vehicle_ids({0});
    message.scenario_sha256(parameters_->scenario_sha256().to_string());
    message.ready(true);
    message.last_complete_step(-1);
    write_sample(*participant_writer_, &message);
    for (const char* mistake : {"long_announcement", "no_state_reader"})
      if (makes(mistake)) say_that_it_begins();
  }

  void fly() {
    dds::SampleInfo info;
    while (state_reader_ && is_ok(state_reader_->take_next_sample(&states_, &info)))
      if (info.valid_data && states_.run_id() == parameters_->run_id()) answer();
  }

  void answer() {
    const std::uint64_t step = states_.step();
    const VehicleState& state = states_.vehicles().front();
    const VehicleParameters& vehicle = parameters_->vehicles().front();
    if (step == 0) start_m_ = state.measured().p_WL_m();

    ControlCommand command;
    command.vehicle_id(0);
    const double mass = vehicle.quad_mass_kg() + vehicle.load_mass_kg();
    command.f_Q_W_n({0.0, 0.0, -mass * vehicle.gravity_m_s2()});
    command.reference().position_m(start_m_);
    command.reference().stage_name("hang");
    command.controller(state.controller());
    command.mission(MissionPhase::MISSION_RUNNING);

    Commands answers;
    answers.run_id(parameters_->run_id());
    answers.step(step);
    answers.client_name(options_.name);
    answers.vehicles().push_back(command);
    write_sample(*command_writer_, &answers);
    for (const char* mistake : {"extra_field", "missing_field", "retyped_field"})
      if (makes(mistake)) say_that_it_begins();
  }

  const Options options_;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  dds::DataWriter* participant_writer_ = nullptr;
  dds::DataWriter* command_writer_ = nullptr;
  dds::DataWriter* states_writer_ = nullptr;
  dds::DataWriter* status_writer_ = nullptr;
  dds::DataReader* parameters_reader_ = nullptr;
  dds::DataReader* status_reader_ = nullptr;
  dds::DataReader* state_reader_ = nullptr;
  std::optional<Parameters> parameters_;
  States states_;
  std::array<double, 3> start_m_{};
  bool has_begun_ = false;
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App cli("A foreign controller with a mistake, for tests.");
  Options options;
  cli.add_option("--domain", options.domain);
  cli.add_option("--mistake", options.mistake);
  cli.add_option("--name", options.name);
  CLI11_PARSE(cli, argc, argv);
  app::install_stop_signals();
  try {
    ForeignClient(options).run();
  } catch (const std::exception& error) {
    std::cerr << "foreign_client: " << error.what() << std::endl;
    return 1;
  }
}
