#pragma once

namespace sls::sim {

/// Samples and lines of the core that only the main thread writes, because a write may block.
class Backlog {
 public:
  virtual ~Backlog() = default;
  virtual bool is_waiting() const = 0;
  /// @throws std::exception if a write is refused: the rest is lost.
  virtual void write_waiting() = 0;
};

}  // namespace sls::sim
