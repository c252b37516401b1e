/// Threads that share the work of a step: independent vehicles integrate in parallel.
#pragma once

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

  /// Calls `work(i)` once for each i below `count` and returns when all are done. Which thread does
  /// which is fixed: equal shares of neighbours.
  /// @throws what `work` throws, for the lowest such i of the first share that has one.
  void for_each(std::size_t count, const std::function<void(std::size_t)>& work);

 private:
  struct Share {
    std::thread thread;
    std::exception_ptr error;
  };
  void serve(std::size_t share);
  void do_share(std::size_t share, std::exception_ptr& error) const;

  const std::size_t threads_;
  std::mutex mutex_;  // over what follows
  std::condition_variable begun_, done_;
  std::uint64_t round_ = 0;
  std::size_t busy_ = 0;
  bool stop_ = false;
  std::size_t count_ = 0;
  const std::function<void(std::size_t)>* work_ = nullptr;
  std::vector<Share> shares_;  // of the others; the caller has share 0
};

}  // namespace sls::sim
