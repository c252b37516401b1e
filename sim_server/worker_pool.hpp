/// Threads that share the work of a step: independent vehicles integrate in parallel.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace sls::sim {

class WorkerPool {
 public:
  /// `threads` ≥ 1, the caller of `for_each` included.
  explicit WorkerPool(std::size_t threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// Calls `work(i)` once for each i below `count` and returns when all are done. Each thread has
  /// an equal share of consecutive i, the same in each call, because its processor's cache may
  /// still hold their data. A thread that has finished its share helps the others, because
  /// processors are not equally fast.
  /// @throws the exception of `work` for the lowest i, after all calls.
  void for_each(std::size_t count, const std::function<void(std::size_t)>& work);

 private:
  struct Share {
    std::atomic<std::size_t> next{0};
    std::size_t end = 0;
  };
  void serve(std::size_t own);
  void do_shares(std::size_t own);

  std::vector<Share> shares_;  // the caller's is the first
  std::vector<std::thread> threads_;
  const std::function<void(std::size_t)>* work_ = nullptr;

  std::mutex mutex_;  // protects the members below
  std::condition_variable begun_, done_;
  std::uint64_t round_ = 0;
  std::size_t busy_ = 0;
  bool stop_ = false;
  std::exception_ptr error_;
  std::size_t error_at_ = 0;
};

}  // namespace sls::sim
