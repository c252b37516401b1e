#include "tools/view/live/page_protocol.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/app/version.hpp"
#include "common/bus/names.hpp"
#include "common/bus/sync_counters.hpp"
#include "common/config/config_error.hpp"
#include "tools/view/live/client_json.hpp"
#include "tools/view/live/page_frames.hpp"
#include "tools/view/run_description.hpp"

namespace sls::view {
namespace {

using Json = nlohmann::ordered_json;  // sent
using Message = nlohmann::json;       // received

constexpr std::uint64_t kPosesKey = 1;
constexpr std::uint64_t kStatusKey = 2;
constexpr std::size_t kMostQueuedBytes = 512 << 10;  // a page further behind gets no rows
constexpr int kMostMistakes = 8;
constexpr std::uint64_t kMostId = std::uint64_t{1} << 53;  // integers that JavaScript holds exactly
constexpr std::uint16_t kPolicyViolation = 1008;

std::string to_hex(std::uint64_t run_id) { return fmt::format("{:016x}", run_id); }

// --- status --------------------------------------------------------------------------------------

std::string describe_waiting(const RunView& view) {
  const auto& status = view.run.status;
  if (view.is_silent)
    return fmt::format("the server (silent for {:.1f} s{})", view.silence_s,
                       view.is_gone ? ", gone" : "");
  if (!status) return "the server's first status";
  if (status->phase() == RunPhase::PHASE_WAITING) return status->reason().to_string();
  if (sync::calc_progress(status->phase()) < 0 && view.is_gone) return "another flight";
  return {};
}

Json describe_participants(const std::vector<Participant>& participants) {
  Json list = Json::array();
  for (const Participant& participant : participants)
    list.push_back({{"role", bus::to_string(participant.role())},
                    {"name", participant.name().to_string()},
                    {"host", participant.host().to_string()},
                    {"vehicle_ids", participant.vehicle_ids()},
                    {"ready", participant.ready()},
                    {"done", participant.done()},
                    {"last_complete_step", participant.last_complete_step()}});
  return list;
}

Json describe_status(const RunView& view, const std::string& stage) {
  const SimStatus status = view.run.status.value_or(SimStatus());
  const double period_s = static_cast<double>(view.run.parameters.period_ns()) * 1e-9;
  Json counters = Json::object();
  for (const bus::SyncCounter& counter : bus::kSyncCounters)
    counters[counter.name] = (status.counters().*counter.get)();
  return {{"op", "status"},
          {"run_id", to_hex(view.run.parameters.run_id())},
          {"phase", bus::to_string(status.phase())},
          {"stage", stage},
          {"reason", status.reason().to_string()},
          {"step", status.step()},
          {"sim_time_s", static_cast<double>(status.step()) * period_s},
          {"controller", status.controller_name().to_string()},
          {"real_time_factor", status.real_time_factor()},
          {"round_trip_p50_us", static_cast<double>(status.round_trip_p50_ns()) * 1e-3},
          {"round_trip_p99_us", static_cast<double>(status.round_trip_p99_ns()) * 1e-3},
          {"timing", status.timing().to_string()},
          {"problem", status.problem().to_string()},
          {"counters", std::move(counters)},
          {"is_silent", view.is_silent},
          {"silence_s", view.silence_s},
          {"waiting_for", describe_waiting(view)},
          {"participants", describe_participants(view.participants)}};
}

// --- all pages together --------------------------------------------------------------------------

class PageSession;

/// Decodes and formats the messages once for all pages. Listens to the feed while there is a page.
class PageHub : public Feed::Listener {
 public:
  PageHub(Feed& feed, Operator& requests, const PageOptions& options)
      : feed_(feed), requests_(requests), options_(options) {}

  void join(PageSession& session);
  void leave(PageSession& session);

  void note(const Sample& sample) override {
    if (sample.topic == TopicId::kRecord && has_run_ && sample.sender == server_)
      frames_.add(sample);
  }
  void note(const RunView* view) override;
  void note_event(const RunEvent& event) override;
  void end_batch() override;

  const PageOptions& options() const { return options_; }
  Operator& requests() { return requests_; }
  /// True if the run has this vehicle, or if there is no run yet.
  bool may_select(std::uint32_t vehicle_id) const {
    return !has_run_ || frames_.has_vehicle(vehicle_id);
  }

 private:
  Payload make_message(const RunEvent& event) const;
  void start_run(const Parameters& parameters);
  void send_status(const RunView& view);
  void note_stage();
  void send_all(const Payload& message, Delivery delivery, std::uint64_t key = 0);
  void send_past(PageSession& session) const;
  Payload make_no_run() const;

  Feed& feed_;
  Operator& requests_;
  const PageOptions options_;
  std::vector<PageSession*> sessions_;
  bool has_run_ = false;
  bus::PeerId server_{};  // of the run
  double period_s_ = 0;
  PageFrames frames_;
  Payload run_message_;     // run, or no_run
  Payload status_message_;  // null: none yet
  std::string stage_;       // the last one flown
  std::deque<RunEvent> events_;
};

// --- one page ------------------------------------------------------------------------------------

class PageSession : public Session {
 public:
  PageSession(std::shared_ptr<PageHub> hub, Connection& connection)
      : hub_(std::move(hub)), connection_(connection) {
    send_hello();
    hub_->join(*this);
  }
  ~PageSession() override {
    *is_alive_ = false;
    hub_->leave(*this);
  }

  void receive(MessageKind kind, std::string_view message) override;

  Connection& connection() { return connection_; }
  /// Vehicle whose rows the page gets; none: the one with the lowest id.
  std::optional<std::uint32_t> selected() const { return selected_; }
  void forget_selection() { selected_.reset(); }

 private:
  void send(const Json& json) {
    connection_.send(MessageKind::kText, to_payload(json), Delivery::kAlways);
  }
  void send_hello();
  void refuse(const std::string& text);
  void authenticate(const Message& message);
  void select(const Message& message);
  void control(const Message& message);
  std::string find_obstacle() const;

  const std::shared_ptr<PageHub> hub_;
  Connection& connection_;
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);  // for late replies
  std::optional<std::uint32_t> selected_;
  int mistakes_ = 0;
};

/// Reason why this page may not operate; empty if it may.
std::string PageSession::find_obstacle() const {
  if (!connection_.may_operate()) return connection_.why_not();
  if (!hub_->requests().may_ask())
    return "the viewer's keys are not an operator's: start it with --identity operator";
  return {};
}

void PageSession::send_hello() {
  const std::string obstacle = find_obstacle();
  send({{"op", "hello"},
        {"version", app::version()},
        {"domain", hub_->options().domain},
        {"vehicle_id", hub_->options().vehicle_id},
        {"may_operate", obstacle.empty()},
        {"why_not", obstacle},
        {"needs_token", hub_->options().takes_token && !connection_.may_operate()}});
}

void PageSession::refuse(const std::string& text) {
  send({{"op", "error"}, {"text", text}});
  if (++mistakes_ == kMostMistakes)
    connection_.close(kPolicyViolation, "too many malformed messages");
}

/// A whole number from 0 to `most`, or nothing.
std::optional<std::uint64_t> find_number(const Message& message, const char* key,
                                         std::uint64_t most) {
  const auto found = message.find(key);
  if (found == message.end() || !found->is_number_unsigned()) return std::nullopt;
  const auto number = found->get<std::uint64_t>();
  return number <= most ? std::optional(number) : std::nullopt;
}

std::optional<std::string> find_text(const Message& message, const char* key) {
  const auto found = message.find(key);
  if (found == message.end() || !found->is_string()) return std::nullopt;
  return found->get<std::string>();
}

void PageSession::receive(MessageKind kind, std::string_view text) {
  if (mistakes_ >= kMostMistakes) return;  // the connection is being closed
  if (kind != MessageKind::kText) return refuse("expected text, got a binary message");
  const Message message = parse_client_json(text);
  if (!message.is_object()) return refuse("expected a JSON object with at most 16 keys");
  const auto op = find_text(message, "op");
  if (op == "authenticate") return authenticate(message);
  if (op == "select") return select(message);
  if (op == "control") return control(message);
  refuse("op: expected authenticate, select or control");
}

void PageSession::authenticate(const Message& message) {
  const auto token = find_text(message, "token");
  if (!token) return refuse("token: expected text");
  connection_.authenticate(*token, [this](bool is_right) {
    if (!is_right) refuse("token: expected that of --token-file");
    send_hello();
  });
}

void PageSession::select(const Message& message) {
  const auto id = find_number(message, "vehicle_id", std::numeric_limits<std::uint32_t>::max());
  if (!id) return refuse("vehicle_id: expected a whole number from 0 to 4294967295");
  const auto vehicle_id = static_cast<std::uint32_t>(*id);
  if (!hub_->may_select(vehicle_id))
    return refuse(fmt::format("vehicle_id: expected a vehicle of the run, got {}", vehicle_id));
  selected_ = vehicle_id;
}

void PageSession::control(const Message& message) {
  const auto id = find_number(message, "id", kMostId);
  if (!id) return refuse("id: expected a whole number from 0 to 2^53");
  const auto word = find_text(message, "action");
  const auto action = word ? find_action(*word) : std::nullopt;
  if (!action) return refuse("action: expected start, pause, step, resume, reset or stop");
  const bool has_steps = message.contains("steps");
  const auto steps =
      has_steps ? find_number(message, "steps", kMostId) : std::optional<std::uint64_t>(0);
  if (!steps) return refuse("steps: expected a whole number from 0 to 2^53");

  const auto reply = [this, is_alive = is_alive_, id = *id,
                      word = *word](const OperatorReply& got) {
    if (!*is_alive) return;
    send({{"op", "reply"},
          {"id", id},
          {"action", word},
          {"accepted", got.is_accepted},
          {"reason", got.reason},
          {"step", got.step}});
  };
  const std::string obstacle = find_obstacle();
  if (!obstacle.empty()) return reply({false, obstacle, 0});
  hub_->requests().request(*action, *steps, reply);
}

// --- PageHub -------------------------------------------------------------------------------------

void PageHub::join(PageSession& session) {
  sessions_.push_back(&session);
  if (sessions_.size() == 1)
    feed_.add(*this);  // passes the run and the past events to us, and so to the session
  else
    send_past(session);
}

void PageHub::leave(PageSession& session) {
  sessions_.erase(std::remove(sessions_.begin(), sessions_.end(), &session), sessions_.end());
  if (!sessions_.empty()) return;
  feed_.remove(*this);
  has_run_ = false;
  events_.clear();
  run_message_.reset();
  status_message_.reset();
}

void PageHub::send_all(const Payload& message, Delivery delivery, std::uint64_t key) {
  for (PageSession* session : sessions_)
    session->connection().send(MessageKind::kText, message, delivery, key);
}

void PageHub::send_past(PageSession& session) const {
  Connection& connection = session.connection();
  if (run_message_) connection.send(MessageKind::kText, run_message_, Delivery::kAlways);
  if (status_message_)
    connection.send(MessageKind::kText, status_message_, Delivery::kNewest, kStatusKey);
  for (const RunEvent& event : events_)
    if (has_run_ && event.run_id == frames_.run_id())
      connection.send(MessageKind::kText, make_message(event), Delivery::kAlways);
}

Payload PageHub::make_no_run() const {
  const bool is_usual = options_.domain == 0;
  return to_payload(
      {{"op", "no_run"},
       {"text",
        fmt::format("no flight of vehicle {} on domain {}: expected a server (sls/parameters)",
                    options_.vehicle_id, options_.domain)},
       {"command", is_usual ? "./sls run figure_eight"
                            : fmt::format("./sls run figure_eight --domain {}", options_.domain)}});
}

void PageHub::note(const RunView* view) {
  if (!view) {
    has_run_ = false;
    run_message_ = make_no_run();
    status_message_.reset();
    return send_all(run_message_, Delivery::kAlways);
  }
  const Parameters& parameters = view->run.parameters;
  server_ = view->run.server;
  if (!has_run_ || parameters.run_id() != frames_.run_id()) start_run(parameters);
  send_status(*view);
}

void PageHub::send_status(const RunView& view) {
  status_message_ = to_payload(describe_status(view, stage_));
  send_all(status_message_, Delivery::kNewest, kStatusKey);
}

/// Sends a status when a stage begins, because the server publishes none then.
void PageHub::note_stage() {
  const std::string stage = frames_.find_stage();
  if (stage.empty() || stage == stage_) return;
  stage_ = stage;
  if (const RunView* view = feed_.run()) send_status(*view);
}

void PageHub::start_run(const Parameters& parameters) {
  has_run_ = true;
  stage_.clear();
  frames_.start_run(parameters);
  period_s_ = static_cast<double>(parameters.period_ns()) * 1e-9;
  try {
    run_message_ = to_payload({{"op", "run"}, {"run", Json::parse(describe_run(parameters))}});
  } catch (const config::ConfigError& error) {
    spdlog::warn("{}", error.what());
    run_message_ = to_payload({{"op", "error"}, {"text", error.what()}});
  }
  send_all(run_message_, Delivery::kAlways);
  for (PageSession* session : sessions_)
    if (session->selected() && !frames_.has_vehicle(*session->selected()))
      session->forget_selection();
  for (const RunEvent& event : events_)
    if (event.run_id == frames_.run_id()) send_all(make_message(event), Delivery::kAlways);
}

/// Message about an event of the current run.
Payload PageHub::make_message(const RunEvent& event) const {
  return to_payload({{"op", "event"},
                     {"run_id", to_hex(event.run_id)},
                     {"step", event.step},
                     {"sim_time_s", static_cast<double>(event.step) * period_s_},
                     {"text", event.text}});
}

void PageHub::note_event(const RunEvent& event) {
  if (has_run_ && event.run_id == frames_.run_id())
    send_all(make_message(event), Delivery::kAlways);
  events_.push_back(event);
  if (events_.size() > kPastEvents) events_.pop_front();
}

void PageHub::end_batch() {
  if (!has_run_ || !frames_.decode()) return;
  note_stage();
  const auto poses = std::make_shared<const std::string>(frames_.make_poses());
  std::map<std::uint32_t, Payload> rows;  // by vehicle
  for (PageSession* session : sessions_) {
    Connection& connection = session->connection();
    connection.send(MessageKind::kBinary, poses, Delivery::kNewest, kPosesKey);
    const std::uint32_t id = session->selected().value_or(frames_.lowest_vehicle());
    const auto [made, is_new] = rows.try_emplace(id);
    if (is_new) made->second = std::make_shared<const std::string>(frames_.make_rows(id));
    if (!made->second->empty() && connection.queued_bytes() < kMostQueuedBytes)
      connection.send(MessageKind::kBinary, made->second, Delivery::kDroppable);
  }
}

}  // namespace

Protocol make_page_protocol(Feed& feed, Operator& requests, const PageOptions& options) {
  auto hub = std::make_shared<PageHub>(feed, requests, options);
  return {{kPageProtocol}, [hub](Connection& connection) -> std::unique_ptr<Session> {
            return std::make_unique<PageSession>(hub, connection);
          }};
}

}  // namespace sls::view
