#include "tools/view/live/operator.hpp"

#include <spdlog/spdlog.h>

#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <thread>
#include <utility>

#include "common/app/mailbox.hpp"
#include "common/app/stop_signal.hpp"
#include "common/config/config_error.hpp"
#include "tools/ctl/operator_client.hpp"

namespace sls::view {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMostRequests = 8;
constexpr double kTimeout = 5;  // s, to find a run and again for its reply

}  // namespace

std::optional<ControlAction> find_action(std::string_view word) {
  for (const ControlAction action :
       {ControlAction::ACTION_START, ControlAction::ACTION_PAUSE, ControlAction::ACTION_STEP,
        ControlAction::ACTION_RESUME, ControlAction::ACTION_RESET, ControlAction::ACTION_STOP})
    if (word == ctl::to_string(action)) return action;
  return std::nullopt;
}

struct Operator::Impl {
  struct Request {
    ControlAction action;
    std::uint64_t steps;
    std::function<void(const OperatorReply&)> done;
  };

  Impl(bus::Node& bus_node, std::uint32_t vehicle, Feed::Post post_task, bool may)
      : node(bus_node), vehicle_id(vehicle), post(std::move(post_task)), may_ask(may) {
    if (may_ask) thread = std::thread([this] { work(); });
  }

  ~Impl() {
    *is_alive = false;
    is_ending = true;
    requests.interrupt();
    if (thread.joinable()) thread.join();
  }

  void work() {
    while (!is_ending) {
      requests.wait(std::chrono::steady_clock::now() + 1s);
      for (Request& request : requests.take_all()) {
        if (is_ending) return;
        reply(std::move(request), ask(request.action, request.steps));
      }
    }
  }

  OperatorReply ask(ControlAction action, std::uint64_t steps) {
    try {
      if (!client) make_client();
      const auto run = client->wait_for_run();
      const auto reply = run ? client->ask(*run, action, steps) : std::nullopt;
      if (!reply) return {false, "the viewer is ending", 0};
      return {reply->accepted(), reply->reason().to_string(), reply->step()};
    } catch (const std::exception& error) {
      return {false, error.what(), 0};
    }
  }

  /// Called at the first request, so that a viewer that only reads has no writer of sls/control.
  void make_client() {
    ctl::ClientOptions options;
    options.vehicle_id = vehicle_id;
    options.timeout_s = kTimeout;
    client.emplace(node, options);
  }

  void reply(Request request, OperatorReply reply) {
    if (reply.is_accepted)
      spdlog::info("{} done at step {}", ctl::to_string(request.action), reply.step);
    else
      spdlog::info("{} refused: {}", ctl::to_string(request.action), reply.reason);
    post([this, alive = is_alive, done = std::move(request.done), reply = std::move(reply)] {
      if (!*alive) return;
      --open_requests;
      done(reply);
    });
  }

  bus::Node& node;
  const std::uint32_t vehicle_id;
  const Feed::Post post;
  const bool may_ask;
  const std::shared_ptr<bool> is_alive = std::make_shared<bool>(true);  // server's thread
  std::size_t open_requests = 0;                                        // likewise
  app::Mailbox<Request> requests{kMostRequests + 1};
  std::atomic<bool> is_ending{false};
  std::optional<ctl::OperatorClient> client;  // used by `thread` only
  std::thread thread;                         // a reply may take as long as its steps
};

Operator::Operator(bus::Node& node, std::uint32_t vehicle_id, Feed::Post post, bool may_ask)
    : impl_(std::make_unique<Impl>(node, vehicle_id, std::move(post), may_ask)) {}
Operator::~Operator() = default;

bool Operator::may_ask() const { return impl_->may_ask; }

void Operator::request(ControlAction action, std::uint64_t steps,
                       std::function<void(const OperatorReply&)> done) {
  const auto refuse = [&](std::string reason) {
    impl_->post([done, reply = OperatorReply{false, std::move(reason), 0}] { done(reply); });
  };
  if (!impl_->may_ask)
    return refuse("the viewer's keys are not an operator's: --identity operator");
  if (impl_->open_requests >= kMostRequests)
    return refuse(fmt::format("{} requests wait already", kMostRequests));
  ++impl_->open_requests;
  impl_->requests.put({action, steps, std::move(done)});
}

bool may_write_requests(bus::Node& node) {
  try {
    const bus::Writer<SimControl> writer(node);
    return true;
  } catch (const config::ConfigError&) {
    return false;
  }
}

}  // namespace sls::view
