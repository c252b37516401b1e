#include "sim_server/worker_pool.hpp"

#include <utility>

namespace sls::sim {

WorkerPool::WorkerPool(std::size_t threads) : shares_(threads) {
  for (std::size_t own = 1; own < threads; ++own)
    threads_.emplace_back([this, own] { serve(own); });
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  begun_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void WorkerPool::for_each(std::size_t count, const std::function<void(std::size_t)>& work) {
  {
    const std::lock_guard lock(mutex_);
    work_ = &work;
    for (std::size_t i = 0; i < shares_.size(); ++i) {
      shares_[i].next = i * count / shares_.size();
      shares_[i].end = (i + 1) * count / shares_.size();
    }
    busy_ = threads_.size();
    ++round_;
  }
  begun_.notify_all();
  do_shares(0);
  std::unique_lock lock(mutex_);
  done_.wait(lock, [this] { return busy_ == 0; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void WorkerPool::serve(std::size_t own) {
  std::uint64_t round = 0;
  std::unique_lock lock(mutex_);
  while (true) {
    begun_.wait(lock, [&] { return stop_ || round_ != round; });
    if (stop_) return;
    round = round_;
    lock.unlock();
    do_shares(own);
    lock.lock();
    if (--busy_ == 0) done_.notify_one();
  }
}

void WorkerPool::do_shares(std::size_t own) {
  for (std::size_t k = 0; k < shares_.size(); ++k) {
    Share& share = shares_[(own + k) % shares_.size()];
    for (std::size_t i = share.next++; i < share.end; i = share.next++) {
      try {
        (*work_)(i);
      } catch (...) {
        const std::lock_guard lock(mutex_);
        if (error_ && error_at_ < i) continue;
        error_ = std::current_exception();
        error_at_ = i;
      }
    }
  }
}

}  // namespace sls::sim
