/// The participant ids that are taken in this process (README.md, trap 29). Upstream: none
/// reported. To be deleted when creating a participant whose id is taken chooses another id, or
/// fails without deleting the participant that has it.
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <set>

#include "common/config/domain.hpp"

namespace sls::bus {

/// Ids of the participants of this process on all domains: bytes 8 and 9 of their GUID, least
/// significant first. Fast DDS 3 counts the uses of an id in the next two.
inline std::set<int> find_own_participant_ids() {
  namespace dds = eprosima::fastdds::dds;
  std::set<int> ids;
  for (dds::DomainId_t domain = 0; domain <= config::kMaxDomain; ++domain)
    for (const dds::DomainParticipant* participant :
         dds::DomainParticipantFactory::get_instance()->lookup_participants(domain)) {
      const auto& prefix = participant->guid().guidPrefix.value;
      ids.insert(prefix[8] | prefix[9] << 8);
    }
  return ids;
}

}  // namespace sls::bus
