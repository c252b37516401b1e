/// Shared memory is for programs with the same build of Fast DDS. Another build, of a ROS 2 node
/// for example, lays its segments out otherwise, and a process that opens one of them aborts by an
/// assertion of Boost, or misreads it (README.md, trap 45).
///
/// An address in shared memory contains a number of the host. So ours contain a number that depends
/// on the build, too: each build takes the addresses of another for those of another host, in both
/// directions, and the two use UDP. Upstream: none reported. To be deleted when Fast DDS compares
/// layouts before it opens a segment.
#pragma once

#include <cstdint>

namespace sls::bus {

/// Identifies the build of Fast DDS that this process has loaded: 1 to 32,767, from the build id of
/// its file. It is the upper half of the numbers of our ports in shared memory, too, since those of
/// other programs would have the same names.
std::uint16_t middleware_build();

/// Makes the number in the addresses of this process depend on the build. Call it between the
/// creation of the first participant, which computes the number and puts it into GUIDs, too, and
/// its `enable()`. Returns false if this release of Fast DDS has no such number.
bool mark_host();

}  // namespace sls::bus
