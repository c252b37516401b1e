#pragma once

namespace sls::sim {

/// What the core has said, and only the main thread may write, because it may block.
class Backlog {
 public:
  virtual ~Backlog() = default;
  virtual bool is_waiting() const = 0;
  /// @throws std::exception if a write is refused: the rest is lost.
  virtual void write_waiting() = 0;
};

}  // namespace sls::sim
