#include "sim_server/domain_view.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>

#include "common/app/stop_signal.hpp"

namespace sls::sim {

std::vector<sync::Member> DomainView::find_members(ParticipantRole role,
                                                   std::uint64_t run_id) const {
  auto found = endpoints_.participants.find(role, run_id);
  if (role == ParticipantRole::ROLE_CONTROLLER)
    keep_matched(found, endpoints_.states.matched(), endpoints_.commands.matched());
  return found;
}

Neighbourhood DomainView::look(bool is_known) {
  const bus::Node& domain = endpoints_.domain;
  Neighbourhood seen;
  seen.participants = endpoints_.participants.all();
  seen.add(endpoints_.servers.runs());
  for (const bus::PeerId& peer : endpoints_.commands.matched())
    seen.command_writers[peer] = domain.describe(peer);
  seen.is_on_network = !domain.stays_on_this_machine();
  seen.announcement_writers = endpoints_.participants.writers();
  seen.state_readers = endpoints_.states.matched();
  if (is_known) find_informed();
  seen.informed = informed_;
  endpoints_.servers.look_for_impostors();
  seen.missing_deadlines = domain.find_missing_deadlines();
  seen.explained = domain.find_misfits();
  return seen;
}

void DomainView::find_informed() {
  const auto has_all = [](auto& writer) {
    return writer.wait_for_acknowledgments(std::chrono::milliseconds(0));
  };
  const auto readers = endpoints_.status.matched();
  const auto of_parameters = endpoints_.parameters.matched();
  if (!has_all(endpoints_.status) || !has_all(endpoints_.parameters)) return;
  std::set_intersection(readers.begin(), readers.end(), of_parameters.begin(), of_parameters.end(),
                        std::inserter(informed_, informed_.end()));
}

std::string DomainView::replace_problems(const std::map<std::string, std::string>& found) {
  bus::Problems& problems = endpoints_.domain.problems();
  problems.replace("run ", found);
  return problems.describe();
}

std::string DomainView::stop_signal() const { return app::describe_stop(); }

}  // namespace sls::sim
