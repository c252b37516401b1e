/// Writers and readers of bare Fast DDS, with the profiles of a QoS file but without common/bus.
/// They only serve to measure the speed of Fast DDS itself.
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "common/bus/fastdds/endpoints.hpp"
#include "common/bus/node.hpp"

namespace sls::bench {

namespace dds = bus::dds;

class BareNode {
 public:
  /// @throws config::ConfigError as bus::Node does. @throws bus::BusError if it cannot join.
  BareNode(const std::filesystem::path& qos_file, int domain, const std::string& identity);
  ~BareNode();
  BareNode(const BareNode&) = delete;
  BareNode& operator=(const BareNode&) = delete;

  dds::Topic* create_topic(const char* name, dds::TypeSupport type);

  dds::DomainParticipant* participant = nullptr;
  dds::Publisher* publisher = nullptr;
  dds::Subscriber* subscriber = nullptr;
};

/// `Type` is the generated type support of `Message`.
template <class Message, class Type>
class BareWriter : dds::DataWriterListener {
 public:
  BareWriter(BareNode& node, const char* topic, const char* profile) : publisher_(node.publisher) {
    dds::DataWriterQos qos;
    node.publisher->get_datawriter_qos_from_profile(profile, qos);
    writer_ = node.publisher->create_datawriter(
        node.create_topic(topic, dds::TypeSupport(new Type)), qos, this);
    if (!writer_) throw bus::BusError(std::string(topic) + ": no writer");
  }
  ~BareWriter() override { bus::delete_writer(*publisher_, writer_); }

  void write(Message& message) { bus::write_sample(*writer_, &message); }
  std::size_t count_matched() const { return static_cast<std::size_t>(matched_); }

 private:
  void on_publication_matched(dds::DataWriter*,
                              const dds::PublicationMatchedStatus& status) override {
    matched_ = status.current_count;
  }
  std::atomic<int> matched_{0};
  dds::Publisher* publisher_;
  dds::DataWriter* writer_ = nullptr;
};

template <class Message, class Type>
class BareReader : dds::DataReaderListener {
 public:
  using Handler = std::function<void(const Message&)>;

  /// `handler` is called for every sample on a thread of the middleware.
  BareReader(BareNode& node, const char* topic, const char* profile, Handler handler)
      : handler_(std::move(handler)), subscriber_(node.subscriber) {
    dds::DataReaderQos qos;
    node.subscriber->get_datareader_qos_from_profile(profile, qos);
    reader_ = node.subscriber->create_datareader(
        node.create_topic(topic, dds::TypeSupport(new Type)), qos, this);
    if (!reader_) throw bus::BusError(std::string(topic) + ": no reader");
  }
  ~BareReader() override {
    reader_->set_listener(nullptr);
    subscriber_->delete_datareader(reader_);
  }

  std::size_t count_matched() const { return static_cast<std::size_t>(matched_); }

 private:
  void on_data_available(dds::DataReader* source) override {
    dds::SampleInfo info;
    while (bus::is_ok(source->take_next_sample(buffer_.get(), &info)))
      if (info.valid_data) handler_(*buffer_);
  }
  void on_subscription_matched(dds::DataReader*,
                               const dds::SubscriptionMatchedStatus& status) override {
    matched_ = status.current_count;
  }
  const Handler handler_;
  const std::unique_ptr<Message> buffer_ = std::make_unique<Message>();
  std::atomic<int> matched_{0};
  dds::Subscriber* subscriber_;
  dds::DataReader* reader_ = nullptr;
};

}  // namespace sls::bench
