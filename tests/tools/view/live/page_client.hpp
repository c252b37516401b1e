/// A fake page for a real sls_view: opens a WebSocket to it and keeps the messages.
#pragma once

#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/process.hpp"
#include "tests/tools/view/live/binary_message.hpp"
#include "tests/tools/view/web/web_client.hpp"

namespace sls::test {

/// The port on which a viewer listens, from its output.
inline std::uint16_t wait_for_port(const Process& viewer) {
  std::smatch found;
  std::string output;
  const bool listens = wait_until([&] {
    output = viewer.output();
    return std::regex_search(output, found, std::regex("page: http://[^\n]*:([0-9]+)/\n"));
  });
  if (!listens) throw std::runtime_error("the viewer does not listen: " + output);
  return static_cast<std::uint16_t>(std::stoi(found[1]));
}

class PageClient {
 public:
  explicit PageClient(std::uint16_t port)
      : client_(open_websocket(port, "sls.view.1")), thread_([this] { work(); }) {}
  ~PageClient() {
    ::shutdown(client_.socket(), SHUT_RDWR);
    thread_.join();
  }

  void say(const nlohmann::json& message) { client_.send(to_bytes({kText, message.dump()})); }

  /// Requests `action` and waits for the reply.
  nlohmann::json control(const std::string& action, std::uint64_t steps = 0) {
    const int id = ++last_id_;
    say({{"op", "control"}, {"id", id}, {"action", action}, {"steps", steps}});
    nlohmann::json reply;
    wait_until([&] {
      reply = last("reply");
      return !reply.is_null() && reply.at("id") == id;
    });
    return reply;
  }

  /// The last message with this `op`; null if there is none.
  nlohmann::json last(const std::string& op) const {
    const std::lock_guard lock(mutex_);
    const auto found = texts_.find(op);
    return found == texts_.end() ? nlohmann::json() : found->second.back();
  }
  std::size_t count(const std::string& op) const {
    const std::lock_guard lock(mutex_);
    const auto found = texts_.find(op);
    return found == texts_.end() ? 0 : found->second.size();
  }
  std::optional<Poses> poses() const {
    const std::lock_guard lock(mutex_);
    return poses_;
  }
  /// All received rows of the last run, by time.
  std::map<double, std::vector<float>> rows() const {
    const std::lock_guard lock(mutex_);
    return rows_;
  }

  bool wait_for_status(const std::string& field, const nlohmann::json& value) const {
    return wait_until([&] {
      const auto status = last("status");
      return !status.is_null() && status.at(field) == value;
    });
  }
  bool wait_for_step(std::uint64_t step) const {
    return wait_until([&] {
      const auto newest = poses();
      return newest && newest->step >= step;
    });
  }

 private:
  void work() {
    for (;;) {
      const Frame frame = client_.read_frame();
      if (frame.opcode == -1 || frame.opcode == kClose) return;
      if (frame.opcode == kPing) client_.send(to_bytes({kPong, frame.payload}));
      const std::lock_guard lock(mutex_);
      if (frame.opcode == kText) {
        const auto message = nlohmann::json::parse(frame.payload);
        texts_[message.at("op")].push_back(message);
      } else if (frame.opcode == kBinary && find_kind(frame.payload) == 1) {
        poses_ = read_poses(frame.payload);
      } else if (frame.opcode == kBinary) {
        note(read_rows(frame.payload));
      }
    }
  }

  void note(const RowsMessage& message) {
    if (message.run_id != run_id_) rows_.clear();
    run_id_ = message.run_id;
    for (std::size_t i = 0; i < message.rows.size(); ++i) rows_[message.times[i]] = message.rows[i];
  }

  RawClient client_;
  int last_id_ = 0;
  mutable std::mutex mutex_;  // guards the members below
  std::map<std::string, std::vector<nlohmann::json>> texts_;
  std::optional<Poses> poses_;
  std::map<double, std::vector<float>> rows_;
  std::uint64_t run_id_ = 0;
  std::thread thread_;  // last: it uses the members above
};

}  // namespace sls::test
