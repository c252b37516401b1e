/// The announcements of our own endpoints. Internal to the doctor, because it exposes Fast DDS.
#pragma once

#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>

#include <string>
#include <vector>

#include "tools/doctor/endpoint.hpp"

namespace sls::doctor {

/// The writers and readers that the programs make in lockstep from the loaded profiles of `file`.
std::vector<Endpoint> make_own_endpoints(eprosima::fastdds::dds::Publisher& publisher,
                                         eprosima::fastdds::dds::Subscriber& subscriber,
                                         const std::string& file);

}  // namespace sls::doctor
