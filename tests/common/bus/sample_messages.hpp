/// Messages in which every field has a different value, which also depends on `seed`.
#pragma once

#include <cstdint>

#include "common/bus/topics.hpp"

namespace sls::test {

/// All strings and sequences as long as their bounds allow.
template <class Message>
Message make_message(std::uint64_t seed);

}  // namespace sls::test
