#include "worlds/trace.hpp"

#include <spdlog/fmt/fmt.h>

namespace sls::worlds {

void Trace::add(std::string_view text) {
  for (const char letter : text)
    hash_ = (hash_ ^ static_cast<unsigned char>(letter)) * 0x100000001b3u;
  add(text.size());
}

void Trace::add(Instant now, std::string_view who, std::string_view what) {
  add(static_cast<std::uint64_t>(now.count()));
  add(who);
  add(what);
  if (keeps_lines_)
    lines_.push_back(
        fmt::format("{:10.6f} s  {:12} {}", std::chrono::duration<double>(now).count(), who, what));
}

}  // namespace sls::worlds
