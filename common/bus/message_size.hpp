#pragma once

#include <cstddef>

#include "fastcdr_api.hpp"

namespace sls::bus {

/// Number of bytes that `message` adds to a sample after `before` bytes of it, with the padding
/// before it, without the encapsulation header.
template <class Message>
std::size_t calc_size(const Message& message, std::size_t before = 0) {
  return calc_cdr_size(message, before);
}

}  // namespace sls::bus
