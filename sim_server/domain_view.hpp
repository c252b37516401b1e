#pragma once

#include "sim_server/core/participants/surroundings.hpp"
#include "sim_server/endpoints.hpp"
#include "sim_server/outbox.hpp"

namespace sls::sim {

/// The server's surroundings on a DDS domain. For the main thread, except the versions.
class DomainView : public Surroundings {
 public:
  DomainView(Endpoints& endpoints, const Outbox& outbox) : endpoints_(endpoints), outbox_(outbox) {}

  std::uint64_t members_version() const override { return endpoints_.participants.version(); }
  std::vector<sync::Member> find_members(ParticipantRole role, std::uint64_t run_id) const override;
  std::vector<sync::Run> find_other_runs() const override { return endpoints_.servers.runs(); }
  bool is_known_elsewhere(std::uint64_t run_id) const override {
    return endpoints_.servers.is_known(run_id);
  }
  bool stays_on_this_machine() const override { return endpoints_.domain.stays_on_this_machine(); }
  bool has_heard_every_claim() const override { return endpoints_.servers.has_heard_every_claim(); }
  std::uint64_t problems_version() const override { return endpoints_.domain.problems().version(); }
  Neighbourhood find_neighbours() override;
  std::string replace_problems(const std::map<std::string, std::string>& found) override;
  std::string describe_isolation() const override { return endpoints_.domain.describe_isolation(); }
  std::string describe_other_flight() const override {
    return endpoints_.domain.describe_other_flight();
  }
  Queues queues() const override {
    return {outbox_.written_records(), outbox_.history_steps(),
            endpoints_.commands.missed_deadlines()};
  }
  std::optional<std::chrono::nanoseconds> command_lifespan() const override {
    return endpoints_.commands.lifespan();
  }
  std::string stop_signal() const override;

 private:
  Endpoints& endpoints_;
  const Outbox& outbox_;
};

}  // namespace sls::sim
