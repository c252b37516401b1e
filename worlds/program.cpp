#include "worlds/program.hpp"

#include <spdlog/fmt/fmt.h>

#include <utility>

namespace sls::worlds {

void Program::say(std::string text) {
  const std::string& folder = setting_.folder;
  for (std::size_t at = 0; !folder.empty() && (at = text.find(folder)) != std::string::npos;)
    text.replace(at, folder.size(), ".");
  setting_.trace.add(setting_.timeline.now(), name(), text);
}

void Program::kill() {
  if (process_.has_ended()) return;
  setting_.properties.on_killed(*this);
  on_killed();
  process_.kill();
  say("killed");
  setting_.network.leave(peer_, false);
}

void Program::say(const sync::Line& line) {
  setting_.properties.on_line(*this, line.text, servers_);
  say((line.is_warning ? "warning: " : "") + line.text);
}

Instant Program::awake() const {
  return (process_.is_stopped() ? stopped_since_ : setting_.timeline.now()) - stopped_;
}

std::optional<Instant> Program::find_heard(std::uint64_t run_id, const bus::PeerId& server) const {
  const auto heard = heard_.find({run_id, server});
  return heard == heard_.end() ? std::nullopt : std::optional(heard->second);
}

void Program::stop() {
  process_.stop();
  stopped_since_ = setting_.timeline.now();
  setting_.properties.on_stopped(*this);
}

void Program::interrupt() {
  if (process_.has_ended() || was_interrupted()) return;
  stop_signal_ = "interrupted by SIGINT";
  setting_.properties.on_interrupted(*this);
}

void Program::set_slowness(Instant delay) {
  if (slowness_ == delay) return;
  slowness_ = delay;
  setting_.properties.on_disturbed(*this);
}

void Program::go_on() {
  if (process_.has_ended()) return;
  say("continued");
  const Instant stopped =
      setting_.timeline.now() - std::exchange(stopped_since_, setting_.timeline.now());
  if (stopped >= std::chrono::milliseconds(500)) stopped_ += stopped;
  setting_.properties.on_continued(*this);
  setting_.properties.on_disturbed(*this);
  process_.go_on(setting_.timeline.now().count() / 1000 % 3 == 0);
}

void Program::exit(int code, std::string reason) {
  exit_code_ = code;
  ended_ = setting_.timeline.now();
  reason_ = std::move(reason);
  say(fmt::format("ends with exit code {}{}{}", code, reason_.empty() ? "" : ": ", reason_));
  setting_.properties.on_exit(*this);
  process_.end();
  setting_.network.leave(peer_, true);
}

void Program::wake_at(sync::Time time) {
  const Instant latency(setting_.random.integer(5'000, 60'000));
  const Instant due =
      std::max(process_.host().find(clock_.to_steady(time)), setting_.timeline.now() + latency) +
      slowness_;
  if (due >= wakes_) return;
  wakes_ = due;
  clock_.expect_look(time);
  process_.run_at(due, [this, number = ++wake_number_] {
    if (number != wake_number_) return;  // it woke earlier
    wakes_ = Instant::max();
    wake();
  });
}

bool Program::sees(const bus::PeerId& server) const {
  if (role_ == Role::kClient)
    return peer_.matched_writers(TopicId::kState).count(server) > 0 &&
           peer_.matched_readers(TopicId::kCommand).count(server) > 0;
  return peer_.matched_writers(TopicId::kRecord).count(server) > 0 &&
         peer_.matched_writers(TopicId::kStatus).count(server) > 0;
}

void Program::announce(const Participant& message) {
  announced_ = message;
  announced_time_ = now();
  setting_.properties.on_announced(*this, message, servers_);
  peer_.write(message);
}

void Program::repeat_announcement_if_due() {
  if (announced_ && now() - announced_time_ >= sync::kRepeatAfter)
    announce(Participant(*announced_));
}

const sync::Servers& Program::present_servers() {
  servers_.set_present(peer_.matched_writers(TopicId::kParameters));
  look_for_unclaimed();
  return servers_;
}

/// As bus::ServerDirectory.
void Program::look_for_unclaimed() {
  constexpr auto kInterval = std::chrono::milliseconds(100);
  if (now() - looked_for_unclaimed_ < kInterval) return;
  looked_for_unclaimed_ = now();
  std::map<bus::PeerId, std::set<std::string>> writers;
  const auto add = [&](TopicId topic, const char* name) {
    for (const bus::PeerId& peer : peer_.matched_writers(topic)) writers[peer].insert(name);
  };
  add(TopicId::kState, bus::Topic<States>::kName);
  add(TopicId::kStatus, bus::Topic<SimStatus>::kName);
  add(TopicId::kRecord, bus::Topic<RecordBatch>::kName);
  for (const auto& [peer, topics] : servers_.look_for_unclaimed(writers, now()).found)
    setting_.properties.on_unclaimed(*this, *setting_.network.find(peer), setting_.network);
}

sync::Membership& Program::present_members() {
  members_.set_present(peer_.matched_writers(TopicId::kParticipant));
  return members_;
}

void Program::note(const Parameters& sample, const Peer::Arrival& arrival) {
  servers_.set_present(peer_.matched_writers(TopicId::kParameters));
  if (sample.contract_sha256() == bus::kContractSha256)
    servers_.note(sample, arrival.sender, now());
}

void Program::note(const SimStatus& sample, const Peer::Arrival& arrival) {
  servers_.set_present(peer_.matched_writers(TopicId::kParameters));
  servers_.note(sample, arrival.sender, now());
  heard_[{sample.run_id(), arrival.sender}] = awake();
}

void Program::note(const Participant& sample, const Peer::Arrival& arrival) {
  present_members().note(sample, arrival.sender,
                         {now(), arrival.written, process_.host().wall() - arrival.written});
}

}  // namespace sls::worlds
