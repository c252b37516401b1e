// Checks of the domain and its samples: which programs are there, and whether samples arrive.
#include <algorithm>
#include <chrono>
#include <iomanip>
#include <map>
#include <set>
#include <sstream>

#include "common/bus/topics.hpp"
#include "tools/doctor/diagnosis_parts.hpp"

namespace sls::doctor {
namespace {

constexpr const char* kServer = "sim_server";

/// Larger than the difference of synchronised clocks, smaller than the greatest age of a command.
constexpr std::chrono::nanoseconds kClockTolerance = std::chrono::milliseconds(100);
/// For the case that only the delay of samples is known, which is larger on a busy machine.
constexpr std::chrono::nanoseconds kDelayTolerance = std::chrono::seconds(1);

std::string name_seconds(std::chrono::nanoseconds time) {
  std::ostringstream text;
  text << std::setprecision(3) << std::chrono::duration<double>(std::chrono::abs(time)).count()
       << " s";
  return text.str();
}

// --- the domain ----------------------------------------------------------------------------------

/// Names of our programs by domain, from multicast announcements and discovery.
std::map<int, std::set<std::string>> find_flying(const Observations& seen) {
  std::map<int, std::set<std::string>> flying;
  for (const Heard& heard : seen.heard)
    if (is_flying(heard.announcement.name) && is_of_peer(seen, heard.address))
      flying[heard.domain].insert(heard.announcement.name);
  for (const Program& program : seen.programs)
    if (is_flying(program.name) && is_of_peer(seen, program))
      flying[seen.domain].insert(program.name);
  return flying;
}

std::string list_flying(const std::set<std::string>& names) {
  return join({names.begin(), names.end()}) + (names.size() == 1 ? " is" : " are");
}

Check check_domain_number(const Observations& seen) {
  constexpr const char* kName = "domain";
  const std::string own = std::to_string(seen.domain);
  auto flying = find_flying(seen);
  const std::set<std::string> here = flying[seen.domain];
  flying.erase(seen.domain);
  std::string elsewhere;
  for (const auto& [domain, names] : flying) {
    // A whole flight misses nobody. It may be that of somebody else.
    if (names.count(kServer) > 0 && names.count("control_client") > 0 &&
        (here.empty() || here.count(kServer) > 0)) {
      elsewhere += "; a flight is on domain " + std::to_string(domain);
      continue;
    }
    // A server and its programs on another domain may be a separate flight. A server on one domain
    // and only programs without a server on the other show a wrong --domain.
    const bool is_lost = here.empty() || (here.count(kServer) == 0) != (names.count(kServer) == 0);
    if (!is_lost) continue;
    const std::string other = std::to_string(domain);
    return finding(kName, list_flying(names) + " on domain " + other + ", and " +
                              (here.empty() ? "no program is" : list_flying(here)) + " on domain " +
                              own + ": they never meet: start all with --domain " + other +
                              ", or all with --domain " + own);
  }
  if (!here.empty()) return ok(kName, list_flying(here) + " on domain " + own + elsewhere);
  if (!seen.peer.empty() && !seen.probes.is_there()) return skipped(kName, "no program is heard");
  if (!seen.peer.empty() && !seen.is_peer_here && !seen.probes.is_answered)
    return finding(kName, "no program of sls is at " + seen.peer + " on domain " + own +
                              ": start it, or sls_doctor --answer there to try the way to it");
  return ok(kName, elsewhere.empty() ? "no program of sls runs on any domain that is heard"
                                     : "no program is on domain " + own + elsewhere);
}

Check check_security(const Observations& seen) {
  constexpr const char* kName = "security";
  const bool is_secured = seen.settings.is_secured;
  const std::string file = seen.qos_file;
  if (!seen.join_error.empty() && is_secured)
    return finding(kName, seen.join_error +
                              ": correct SLS_KEYS and SLS_IDENTITY, or make keys with "
                              "./sls keys DIR");
  std::set<std::string> rejected, others;
  for (const Program& program : seen.programs) {
    // A program that rejects us does not announce its writers and readers.
    const bool is_silent = is_secured && program.is_secured && is_flying(program.name) &&
                           !seen.is_met(program.id) && seen.probes.is_there();
    if (program.is_rejected || is_silent) rejected.insert(name_program(program));
    if (!program.is_rejected && program.is_secured != is_secured && is_flying(program.name))
      others.insert(name_program(program));
  }
  for (const Heard& heard : seen.heard)
    if (heard.domain == seen.domain && is_flying(heard.announcement.name) &&
        is_of_peer(seen, heard.address) && heard.announcement.is_secured != is_secured)
      others.insert(heard.announcement.name + " of " + heard.address);
  if (!others.empty())
    return finding(kName,
                   join({others.begin(), others.end()}) +
                       (is_secured ? " without security, this QoS file with it"
                                   : " with security, this QoS file without it") +
                       ": they ignore each other: use config/qos/secure.xml with SLS_KEYS on "
                       "every machine, or on none");
  if (!rejected.empty())
    return finding(kName,
                   join({rejected.begin(), rejected.end()}) +
                       " and the doctor reject each other: not the same authority, or an "
                       "identity that is not valid: give every machine keys of one ./sls keys "
                       "DIR, and see that they are not expired");
  const std::string& expiry = seen.settings.expiry;
  return ok(kName, is_secured ? "all programs have a valid identity" +
                                    (expiry.empty() ? "" : "; " + expiry)
                              : "no program uses it");
}

// --- samples -------------------------------------------------------------------------------------

/// Discovered endpoints, each with the name of its program.
std::vector<Endpoint> name_owners(const Observations& seen) {
  std::vector<Endpoint> endpoints = seen.endpoints;
  for (Endpoint& endpoint : endpoints) {
    endpoint.owner = "a participant";
    for (const Program& program : seen.programs)
      if (program.id == endpoint.participant) endpoint.owner = name_program(program);
  }
  return endpoints;
}

std::vector<Endpoint> add_own(std::vector<Endpoint> endpoints, const Observations& seen) {
  endpoints.insert(endpoints.end(), seen.own_endpoints.begin(), seen.own_endpoints.end());
  return endpoints;
}

Check make_mismatch_check(const char* name, const std::vector<Mismatch>& found,
                          const std::string& what_to_do, const std::string& else_text) {
  if (found.empty()) return ok(name, else_text);
  std::vector<std::string> texts;
  for (const Mismatch& mismatch : found) texts.push_back(mismatch.topic + ": " + mismatch.text);
  return finding(name, join(texts) + ": these never match" + what_to_do);
}

Check check_types(const Observations& seen) {
  constexpr const char* kName = "types";
  if (!seen.is_joined) return skipped(kName, "not tried");
  return make_mismatch_check(kName, find_type_mismatches(add_own(name_owners(seen), seen)),
                             ": build all programs from one idl/sls.idl",
                             "the same for every topic");
}

Check check_qos(const Observations& seen) {
  constexpr const char* kName = "qos";
  if (!seen.is_joined) return skipped(kName, "not tried");
  const std::vector<Endpoint> theirs = name_owners(seen);
  std::vector<Mismatch> found = find_policy_mismatches(theirs);
  for (const Mismatch& mismatch : find_policy_mismatches(add_own(theirs, seen))) {
    // In real time the programs use other profiles for commands, with a deadline.
    if (mismatch.topic == bus::Topic<Commands>::kName && mismatch.policy == "DEADLINE") continue;
    const bool is_known = std::any_of(found.begin(), found.end(), [&](const Mismatch& known) {
      return known.topic == mismatch.topic && known.policy == mismatch.policy;
    });
    if (!is_known) found.push_back(mismatch);
  }
  return make_mismatch_check(kName, found, ": use one QoS file for all programs",
                             "every writer matches every reader of its topic");
}

/// `is_explained`: another check has a finding.
Check check_data(const Observations& seen, bool is_explained) {
  constexpr const char* kName = "data";
  const std::string cause =
      is_explained ? ": see the faults above"
                   : ": something between the two lets announcements pass and samples not: open " +
                         name_ports(seen) + " on both sides";
  if (!seen.join_error.empty() && !seen.settings.is_secured)
    return finding(kName, seen.join_error + ": no program can join with this QoS file");
  if (!seen.is_joined) return skipped(kName, "not tried, because joining would fail");
  if (!seen.other_end.empty())
    return finding(
        kName, "a second program of this machine died with " + seen.other_end + " when it joined");
  std::vector<std::string> silent, arrived;
  for (const Program& program : seen.programs) {
    if (program.is_expected && program.samples == 0) silent.push_back(name_program(program));
    if (program.samples > 0) arrived.push_back(name_program(program));
  }
  if (!silent.empty())
    return finding(kName,
                   "nothing that " + join(silent) + " wrote arrived, though discovered" + cause);
  const bool is_asked = seen.peer.empty() || seen.probes.is_answered;
  std::vector<std::string> lost;
  for (const auto& [size, is_back] : seen.echoes)
    if (!is_back && is_asked) lost.push_back(std::to_string(size));
  if (!lost.empty() && seen.refusal.empty())
    return finding(kName, "samples of " + join(lost) +
                              " bytes did not come back from a doctor at " + name_peer(seen) +
                              cause);
  if (is_asked && seen.refusal.empty()) arrived.push_back("a doctor at " + name_peer(seen));
  if (arrived.empty()) return skipped(kName, "no program to exchange samples with");
  return ok(kName, "samples arrive from " + join(arrived));
}

Check check_clock(const Observations& seen) {
  constexpr const char* kName = "clock";
  const std::string what_to_do =
      ": commands in real time are dropped as old (LIFESPAN), lockstep does not mind: keep both "
      "clocks right (chrony)";
  if (const auto ahead = seen.probes.clock_ahead; ahead && !seen.is_peer_here)
    return std::chrono::abs(*ahead) <= kClockTolerance
               ? ok(kName, "that of " + seen.peer + " agrees to " + name_seconds(*ahead))
               : finding(kName, "that of " + seen.peer + " is " + name_seconds(*ahead) +
                                    (ahead->count() > 0 ? " ahead" : " behind") + what_to_do);
  bool is_any = false;
  for (const Program& program : seen.programs) {
    if (!program.delay || program.is_on_this_host) continue;
    is_any = true;
    if (std::chrono::abs(*program.delay) > kDelayTolerance)
      return finding(kName, "that of " + name_program(program) + " is " +
                                name_seconds(*program.delay) +
                                (program.delay->count() < 0 ? " ahead" : " behind") + what_to_do);
  }
  return is_any ? ok(kName, "samples are as old as they may be")
                : skipped(kName, "no other machine to compare with");
}

}  // namespace

std::vector<Check> check_domain(const Observations& seen, bool is_explained) {
  std::vector<Check> checks = {check_domain_number(seen), check_security(seen), check_types(seen),
                               check_qos(seen)};
  checks.push_back(check_data(seen, is_explained || has_finding(checks)));
  checks.push_back(check_clock(seen));
  return checks;
}

}  // namespace sls::doctor
