/// Any messages of a Foxglove client, together with any samples of the domain, are answered or
/// refused. An input consists of parts, each: kind, length (2 bytes, little-endian), bytes.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "tests/tools/view/foxglove/fakes.hpp"

namespace {

using namespace sls;
using namespace sls::view;

constexpr int kMostRuns = 3;  // the channels of a run take time
constexpr std::uint8_t kText = 0, kBinary = 1, kRun = 2, kReply = 3, kFirstTopic = 4;

struct Bench {
  void play(std::uint8_t kind, const std::uint8_t* data, std::size_t size) {
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    if (kind == kText) session.receive(MessageKind::kText, bytes);
    if (kind == kBinary) session.receive(MessageKind::kBinary, bytes);
    if (kind == kRun && ++runs <= kMostRuns)
      flight->begin_run(size, {data, data + std::min<std::size_t>(size, 2)});
    if (kind == kReply)
      for (auto& request : std::exchange(flight->requests, {}))
        request.done({size % 2 == 0, std::string(bytes), size});
    if (kind >= kFirstTopic) publish(kind, data, size);
    connection.check();
  }

  void publish(std::uint8_t kind, const std::uint8_t* data, std::size_t size) {
    Sample sample;
    sample.topic = static_cast<TopicId>((kind - kFirstTopic) % kTopics);
    sample.cdr = std::make_shared<std::vector<std::uint8_t>>(data, data + size);
    sample.sender = flight->server;
    flight->kept[sample.topic] = {sample};
    for (Feed::Listener* listener : flight->listeners) listener->note(sample);
  }

  /// Checks that every text sent is JSON, except the long advertisements.
  struct CheckedConnection {
    foxglove::test::FakeConnection connection;
    void check() {
      for (const auto& message : connection.sent)
        if (message.kind == MessageKind::kText && message.bytes.size() < 4096 &&
            !nlohmann::json::accept(message.bytes))
          std::abort();
      connection.sent.clear();
    }
  };

  int runs = 0;
  const std::unique_ptr<foxglove::test::FakeFlight> flight =
      std::make_unique<foxglove::test::FakeFlight>();
  std::chrono::steady_clock::time_point now{std::chrono::hours(1)};
  std::shared_ptr<foxglove::Hub> hub = std::make_shared<foxglove::Hub>(
      *flight, *flight, [this] { return now += std::chrono::milliseconds(7); });
  CheckedConnection connection = make_connection();
  foxglove::FoxgloveSession session{hub, connection.connection};

  static CheckedConnection make_connection() {
    CheckedConnection made;
    made.connection.is_operator = true;
    return made;
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kHeader = 3;
  Bench bench;
  while (size >= kHeader) {
    const std::size_t length = std::min<std::size_t>(data[1] | data[2] << 8, size - kHeader);
    bench.play(data[0], data + kHeader, length);
    data += kHeader + length;
    size -= kHeader + length;
  }
  return 0;
}
