/// A fake connection that keeps all messages.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/view/web/connection.hpp"

namespace sls::test {

/// "k0":0,"k1":0,… for an object.
inline std::string make_keys(int count) {
  std::string keys;
  for (int i = 0; i < count; ++i) keys += (i ? ",\"k" : "\"k") + std::to_string(i) + "\":0";
  return keys;
}

class FakeConnection : public view::Connection {
 public:
  void send(view::MessageKind kind, view::Payload payload, view::Delivery delivery,
            std::uint64_t key) override {
    if (kind == view::MessageKind::kBinary)
      binary.push_back(*payload);
    else
      texts.push_back(nlohmann::json::parse(*payload));
    (void)delivery;
    (void)key;
  }
  std::size_t queued_bytes() const override { return queued; }
  std::uint64_t dropped() const override { return 0; }
  bool may_operate() const override { return obstacle.empty(); }
  std::string why_not() const override { return obstacle; }
  void authenticate(std::string_view token, std::function<void(bool)> judged) override {
    if (token == "the right token") obstacle.clear();
    judged(token == "the right token");
  }
  void close(std::uint16_t code, const std::string&) override { close_code = code; }

  /// Messages with this `op`.
  std::vector<nlohmann::json> find(const std::string& op) const {
    std::vector<nlohmann::json> found;
    for (const auto& text : texts)
      if (text.at("op") == op) found.push_back(text);
    return found;
  }

  std::vector<nlohmann::json> texts;
  std::vector<std::string> binary;
  std::string obstacle;  ///< reason why the client may not operate; "" if it may
  std::size_t queued = 0;
  int close_code = 0;
};

}  // namespace sls::test
