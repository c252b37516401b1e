#pragma once

namespace sls::config {

/// The largest DDS domain. Beyond it, RTPS port numbers overflow.
inline constexpr int kMaxDomain = 232;

}  // namespace sls::config
