/// A fake connection and a fake flight for tests, and samples as Fast CDR writes them.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/topics.hpp"
#include "fastcdr_api.hpp"
#include "tools/view/foxglove/session.hpp"

namespace sls::view::foxglove::test {

using Json = nlohmann::json;
using Endianness = bus::Cdr::Endianness;

template <class Message>
std::vector<std::uint8_t> to_cdr(const Message& message,
                                 Endianness endianness = Endianness::LITTLE_ENDIANNESS) {
  std::vector<std::uint8_t> bytes(100'000);
  eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(bytes.data()), bytes.size());
  bus::Cdr cdr = bus::make_cdr(buffer, endianness);
  cdr.serialize_encapsulation();
  bus::write_message(message, cdr);
  bytes.resize(bus::count_bytes(cdr));
  return bytes;
}

struct Sent {
  MessageKind kind;
  std::string bytes;
  Delivery delivery;
};

class FakeConnection final : public Connection {
 public:
  void send(MessageKind kind, Payload payload, Delivery delivery, std::uint64_t) override {
    sent.push_back({kind, *payload, delivery});
  }
  std::size_t queued_bytes() const override { return 0; }
  std::uint64_t dropped() const override { return dropped_messages; }
  bool may_operate() const override { return is_operator; }
  std::string why_not() const override { return is_operator ? "" : "expected a token"; }
  void authenticate(std::string_view, std::function<void(bool)>) override {}
  void close(std::uint16_t code, const std::string&) override { close_code = code; }

  /// The text messages of `op`, in order.
  std::vector<Json> find(const std::string& op) const {
    std::vector<Json> found;
    for (const Sent& message : sent)
      if (message.kind == MessageKind::kText) {
        Json json = Json::parse(message.bytes);
        if (json.at("op") == op) found.push_back(std::move(json));
      }
    return found;
  }
  /// The binary messages of `opcode`, in order.
  std::vector<std::string> find(char opcode) const {
    std::vector<std::string> found;
    for (const Sent& message : sent)
      if (message.kind == MessageKind::kBinary && message.bytes.at(0) == opcode)
        found.push_back(message.bytes);
    return found;
  }
  /// Texts of the status messages of `level`.
  std::vector<std::string> find_statuses(int level) const {
    std::vector<std::string> texts;
    for (const Json& status : find("status"))
      if (status.at("level") == level) texts.push_back(status.at("message"));
    return texts;
  }

  std::vector<Sent> sent;
  bool is_operator = false;
  std::uint64_t dropped_messages = 0;
  std::uint16_t close_code = 0;
};

class FakeFlight final : public Feed, public Operator {
 public:
  void add(Feed::Listener& listener) override {
    listeners.push_back(&listener);
    if (run) listener.note(&*run);
  }
  void remove(Feed::Listener& listener) override {
    listeners.erase(std::find(listeners.begin(), listeners.end(), &listener));
  }
  void want(TopicId topic) override { ++wanted[topic]; }
  void unwant(TopicId topic) override { --wanted[topic]; }
  std::vector<Sample> latched(TopicId topic) const override {
    const auto found = kept.find(topic);
    return found == kept.end() ? std::vector<Sample>() : found->second;
  }
  bool may_ask() const override { return may_operate; }
  void request(ControlAction action, std::uint64_t steps,
               std::function<void(const OperatorReply&)> done) override {
    requests.push_back({action, steps, std::move(done)});
  }

  void begin_run(std::uint64_t run_id, const std::vector<std::uint32_t>& vehicles) {
    run.emplace();
    run->run.server = server;
    run->run.parameters.run_id(run_id);
    run->run.parameters.period_ns(4'000'000);
    for (const std::uint32_t id : vehicles)
      run->run.parameters.vehicles().emplace_back().vehicle_id(id);
    tell_run();
  }
  void tell_run() {
    for (Feed::Listener* listener : listeners) listener->note(run ? &*run : nullptr);
  }
  template <class Message>
  Sample make_sample(TopicId topic, const Message& message) const {
    return {topic, std::make_shared<std::vector<std::uint8_t>>(to_cdr(message)), 0, server};
  }
  template <class Message>
  Sample publish(TopicId topic, const Message& message) {
    const Sample sample = make_sample(topic, message);
    for (Feed::Listener* listener : listeners) listener->note(sample);
    return sample;
  }

  struct Request {
    ControlAction action;
    std::uint64_t steps;
    std::function<void(const OperatorReply&)> done;
  };
  std::vector<Feed::Listener*> listeners;
  std::map<TopicId, int> wanted;
  std::map<TopicId, std::vector<Sample>> kept;
  std::optional<RunView> run;
  std::vector<Request> requests;
  bool may_operate = true;
  bus::PeerId server{{1, 2, 3}};
};

inline std::string to_service_call(std::uint32_t service, std::uint32_t call,
                                   const std::string& encoding, const std::string& data) {
  std::string bytes(1, 2);
  const auto add = [&bytes](std::uint32_t number) {
    for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>(number >> (8 * i) & 0xff));
  };
  add(service);
  add(call);
  add(static_cast<std::uint32_t>(encoding.size()));
  return bytes + encoding + data;
}

inline std::uint64_t read_number(const std::string& bytes, std::size_t at, std::size_t size) {
  std::uint64_t number = 0;
  for (std::size_t i = size; i-- > 0;)
    number = number << 8 | static_cast<unsigned char>(bytes.at(at + i));
  return number;
}

}  // namespace sls::view::foxglove::test
