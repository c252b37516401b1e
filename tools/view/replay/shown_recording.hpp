/// The recording of the run that a live page shows, also while it is being written.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace sls::view {

/// Reads recordings on a thread of its own, because that may take long. All functions are called on
/// one other thread.
class ShownRecording {
 public:
  /// `bytes`: as load_recorded_run, with the path as name; if it is not there, why.
  using Done = std::function<void(bool is_there, std::shared_ptr<const std::string> bytes)>;

  /// `folder`: a recording, or a folder of recordings; it may come later. `post`: calls a task on
  /// the other thread.
  ShownRecording(std::filesystem::path folder, std::function<void(std::function<void()>)> post)
      : folder_(std::move(folder)), post_(std::move(post)) {}
  ~ShownRecording();

  /// Calls `done` with all that the recording of the run has now. If the run `is_over`, waits until
  /// the recorder has closed it, at most 5 s.
  void ask(std::uint64_t run_id, bool is_over, Done done);
  /// True if nothing is being read, and nobody holds what was read last.
  bool is_idle() const { return !thread_.joinable() && newest_.expired(); }

 private:
  void read_next();
  std::string read(std::uint64_t run_id, bool is_over) const;

  const std::filesystem::path folder_;
  const std::function<void(std::function<void()>)> post_;
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
  std::uint64_t run_id_ = 0;  // of the last request, as `is_over_`
  bool is_over_ = false;
  std::vector<Done> waiting_;
  std::weak_ptr<const std::string> newest_;
  std::atomic<bool> is_ending_{false};
  std::thread thread_;
};

}  // namespace sls::view
