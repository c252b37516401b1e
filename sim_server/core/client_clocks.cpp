#include "sim_server/core/client_clocks.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

/// A client that sends no answer for this long may have a clock for which LIFESPAN drops them all.
constexpr auto kMeasured = 1s;

/// Slow answers for this long are due to the law, not to a busy machine.
constexpr int kSlowAnswers = 3;
constexpr auto kSlowTime = 1s;

/// Longer computing times in answers are not credible.
constexpr std::uint64_t kLongestComputing_ns = 60'000'000'000;

std::chrono::nanoseconds sum_computing(const CommandSample& sample) {
  std::chrono::nanoseconds sum(0);
  for (const OfferedAnswer& offered : sample.answers)
    sum += std::chrono::nanoseconds(
        std::min(offered.answer.compute_time.count(), kLongestComputing_ns));
  return sum;
}

std::string describe(const sync::Member& client, std::chrono::nanoseconds offset, bool is_wrong) {
  const double ahead_s = std::chrono::duration<double>(offset).count();
  const std::string clock =
      fmt::format("the clock of controller '{}' on {}", client.announcement.name().c_str(),
                  client.announcement.host().c_str());
  return is_wrong ? fmt::format(
                        "{} is {:.2f} s {} ours: synchronise the clocks; until then its "
                        "commands expire by their step, not by LIFESPAN",
                        clock, std::abs(ahead_s), ahead_s < 0 ? "behind" : "ahead of")
                  : clock + " agrees with ours again: its commands expire by LIFESPAN again";
}

}  // namespace

void ClientClocks::note(const CommandSample& sample, std::uint64_t step) {
  const std::uint64_t answered = sample.step;
  const auto client = clocks_.find(sample.sender);
  const bool is_remembered = answered <= step && step - answered < published_.size();
  if (client == clocks_.end() || !is_remembered) return;
  client->second.offset.note({published_[answered % published_.size()], sum_computing(sample),
                              sample.written, sample.arrived.wall});
  client->second.noted = sample.arrived.time;
}

std::vector<std::string> ClientClocks::look(const std::vector<sync::Member>& controllers,
                                            std::chrono::nanoseconds lifespan, sync::Time now) {
  std::vector<std::string> news;
  std::map<bus::PeerId, Clock> present;
  is_any_wrong_ = false;
  for (const sync::Member& client : controllers) {
    const auto known = clocks_.find(client.peer);
    Clock& clock = present[client.peer];
    clock = known != clocks_.end() ? known->second : Clock{{}, now, false};
    const bool is_quiet = now - clock.noted > kMeasured;
    if (is_quiet) clock.offset = ClockOffset();
    const auto offset = clock.offset.offset();
    // A clock near the limit must not be reported again and again.
    const auto limit = clock.is_wrong ? lifespan * 2 / 5 : lifespan / 2;
    const bool is_wrong = offset ? std::chrono::abs(*offset) > limit : clock.is_wrong;
    if (is_wrong != std::exchange(clock.is_wrong, is_wrong))
      news.push_back(describe(client, *offset, is_wrong));
    is_any_wrong_ = is_any_wrong_ || is_wrong ||
                    (!offset && (client.age > lifespan || (is_quiet && !client.is_repeated)));
  }
  clocks_ = std::move(present);
  return news;
}

std::string SlowAnswers::note(const CommandSample& sample, std::uint64_t step) {
  const auto computing = sum_computing(sample);
  Client& client = clients_[sample.sender];
  if (computing <= period_) client.count = 0;
  if (computing <= period_ || client.is_reported) return "";
  const sync::Time now = sample.arrived.time;
  if (client.count++ == 0) client.since = now;
  client.is_reported = client.count >= kSlowAnswers && now - client.since >= kSlowTime;
  if (!client.is_reported) return "";
  return fmt::format(
      "step {}: controller '{}' computes an answer for {:.3g} ms, expected less than the period of "
      "{:.3g} ms: its answers come late (a lower --rtf or a longer --period-s gives it time)",
      step, sample.client_name, 1e3 * std::chrono::duration<double>(computing).count(),
      1e3 * sync::to_seconds(period_));
}

}  // namespace sls::sim
