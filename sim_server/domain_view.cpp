#include "sim_server/domain_view.hpp"

#include "common/app/stop_signal.hpp"

namespace sls::sim {

std::vector<sync::Member> DomainView::find_members(ParticipantRole role,
                                                   std::uint64_t run_id) const {
  auto found = endpoints_.participants.find(role, run_id);
  if (role == ParticipantRole::ROLE_CONTROLLER)
    keep_matched(found, endpoints_.states.matched(), endpoints_.commands.matched());
  return found;
}

Neighbourhood DomainView::find_neighbours() {
  const bus::Node& domain = endpoints_.domain;
  Neighbourhood seen;
  seen.participants = endpoints_.participants.all();
  seen.add(endpoints_.servers.runs());
  for (const bus::PeerId& peer : endpoints_.commands.matched())
    seen.command_writers[peer] = domain.describe(peer);
  seen.state_readers = endpoints_.states.matched();
  endpoints_.servers.look_for_impostors();
  seen.missing_deadlines = domain.find_missing_deadlines();
  seen.explained = domain.find_misfits();
  return seen;
}

std::string DomainView::replace_problems(const std::map<std::string, std::string>& found) {
  bus::Problems& problems = endpoints_.domain.problems();
  problems.replace("run ", found);
  return problems.describe();
}

std::string DomainView::stop_signal() const { return app::describe_stop(); }

}  // namespace sls::sim
