#include "sim_server/core/participants/gathering.hpp"

#include <spdlog/fmt/fmt.h>

#include <chrono>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

constexpr auto kUsualStartTime = 300ms;  // of discovery after the claim: not reported
constexpr auto kLongStart = 5s;          // after this the report names ./sls doctor

}  // namespace

Gathering::Gathering(const config::WaitFor& expected, std::string scenario_sha256,
                     std::vector<std::uint32_t> vehicle_ids, sync::Time now)
    : expected_(expected),
      scenario_sha256_(std::move(scenario_sha256)),
      vehicle_ids_(std::move(vehicle_ids)),
      began_(now),
      patience_(now, expected.timeout_s, kUsualStartTime) {}

Gathering::Finding Gathering::look(const Roster& roster, sync::Time now) {
  missing_ = name_missing(roster, expected_, scenario_sha256_, vehicle_ids_);
  if (missing_.empty()) return Finding::kReady;
  return patience_.is_over(now) ? Finding::kGivenUp : Finding::kMissing;
}

std::string Gathering::describe_error() const {
  return fmt::format("not ready within {} s: {}", expected_.timeout_s, missing_);
}

std::optional<Gathering::Report> Gathering::take_report(sync::Time now) {
  if (!patience_.is_report_due(now)) return std::nullopt;
  return Report{
      fmt::format("waiting for: {} ({:.0f} s left)", missing_, patience_.seconds_left(now)),
      now - began_ > kLongStart ? "; run ./sls doctor" : "",
      std::exchange(reported_, missing_) != missing_};
}

}  // namespace sls::sim
