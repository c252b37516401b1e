#include "tools/view/live/operator.hpp"

#include <spdlog/spdlog.h>

#include <atomic>
#include <chrono>
#include <iterator>
#include <list>
#include <thread>
#include <utility>

#include "common/app/mailbox.hpp"
#include "common/app/wait.hpp"
#include "common/config/config_error.hpp"
#include "tools/ctl/operator_client.hpp"

namespace sls::view {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMostRequests = 8;

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
  struct Open {
    Request request;
    ctl::OperatorClient::Question question;
  };

  Impl(bus::Node& bus_node, std::uint32_t vehicle, Feed::Post post_task, bool may, double timeout)
      : node(bus_node),
        vehicle_id(vehicle),
        post(std::move(post_task)),
        may_ask(may),
        timeout_s(timeout) {
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
      // While a reply is open, find_reply waits for it.
      if (open.empty()) requests.wait(std::chrono::steady_clock::now() + 1s);
      for (Request& request : requests.take_all())
        if (!is_ending) send(std::move(request));
      const auto deadline = std::chrono::steady_clock::now() + app::kPollTime;
      for (auto item = open.begin(); item != open.end() && !is_ending;)
        item = look_for_reply(*item, deadline) ? open.erase(item) : std::next(item);
    }
  }

  void send(Request request) {
    try {
      if (!client) make_client();
      const auto run = client->wait_for_run();
      auto question = run ? client->send(*run, request.action, request.steps) : std::nullopt;
      if (!question) return reply(request, {false, "the viewer is ending", 0});
      open.push_back({std::move(request), std::move(*question)});
    } catch (const std::exception& error) {
      reply(request, {false, error.what(), 0});
    }
  }

  bool look_for_reply(Open& item, std::chrono::steady_clock::time_point deadline) {
    try {
      const auto got = client->find_reply(item.question, deadline);
      if (got) reply(item.request, {got->accepted(), got->reason().to_string(), got->step()});
      return got.has_value();
    } catch (const std::exception& error) {
      reply(item.request, {false, error.what(), 0});
      return true;
    }
  }

  /// Called at the first request, so that a viewer that only reads has no writer of sls/control.
  void make_client() {
    ctl::ClientOptions options;
    options.vehicle_id = vehicle_id;
    options.timeout_s = timeout_s;
    client.emplace(node, options);
  }

  void reply(const Request& request, OperatorReply reply) {
    if (reply.is_accepted)
      spdlog::info("{} done at step {}", ctl::to_string(request.action), reply.step);
    else
      spdlog::info("{} refused: {}", ctl::to_string(request.action), reply.reason);
    post([this, alive = is_alive, done = request.done, reply = std::move(reply)] {
      if (!*alive) return;
      --open_requests;
      done(reply);
    });
  }

  bus::Node& node;
  const std::uint32_t vehicle_id;
  const Feed::Post post;
  const bool may_ask;
  const double timeout_s;
  const std::shared_ptr<bool> is_alive = std::make_shared<bool>(true);  // server's thread
  std::size_t open_requests = 0;                                        // likewise
  app::Mailbox<Request> requests{kMostRequests + 1};
  std::atomic<bool> is_ending{false};
  std::optional<ctl::OperatorClient> client;  // used by `thread` only
  std::list<Open> open;                       // likewise
  std::thread thread;                         // a reply may take as long as its steps
};

Operator::Operator(bus::Node& node, std::uint32_t vehicle_id, Feed::Post post, bool may_ask,
                   double timeout_s)
    : impl_(std::make_unique<Impl>(node, vehicle_id, std::move(post), may_ask, timeout_s)) {}
Operator::Operator() = default;
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
